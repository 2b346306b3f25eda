// SPDX-License-Identifier: Apache-2.0
#include "detect/overlay.hpp"

#include <fmt/core.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/units.hpp"

namespace drape {
namespace {

const cv::Scalar tag_colour(255, 140, 0);
const cv::Scalar mark_colour(60, 220, 60);
const cv::Scalar island_colour(40, 220, 255);
const cv::Scalar reject_colour(60, 60, 255);

cv::Point at(const Eigen::Vector2d& px) {
  return {static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y()))};
}

void label(cv::Mat& picture, const Eigen::Vector2d& px, const std::string& text,
           const cv::Scalar& colour) {
  cv::putText(picture, text, at(px + Eigen::Vector2d(9, -6)), cv::FONT_HERSHEY_SIMPLEX, 0.4, colour,
              1, cv::LINE_AA);
}

std::string name_of(MarkId mark) {
  return fmt::format("{},{}", mark.row, mark.col);
}

void outline(cv::Mat& picture, const Detection& dot, const cv::Scalar& colour) {
  cv::ellipse(picture,
              cv::RotatedRect(cv::Point2f(static_cast<float>(dot.centre_px.x()),
                                          static_cast<float>(dot.centre_px.y())),
                              cv::Size2f(static_cast<float>(2 * dot.semi_axes_px.x()),
                                         static_cast<float>(2 * dot.semi_axes_px.y())),
                              static_cast<float>(dot.axis_angle_rad / units::deg)),
              colour, 1, cv::LINE_AA);
}

}  // namespace

std::vector<unsigned char> overlay_png(const GreyImage& image, const FrameDetections& frame) {
  const cv::Mat grey(image.height_px, image.width_px, CV_8U,
                     const_cast<std::uint8_t*>(image.bytes.data()));
  cv::Mat picture;
  cv::cvtColor(grey, picture, cv::COLOR_GRAY2BGR);
  for (const TagDetection& tag : frame.tags) {
    for (int k = 0; k < 4; ++k) {
      cv::line(picture, at(tag.corners_px.col(k)), at(tag.corners_px.col((k + 1) % 4)), tag_colour,
               2, cv::LINE_AA);
    }
  }
  for (const Detection& dot : frame.detections) {
    outline(picture, dot, mark_colour);
    label(picture, dot.centre_px, name_of(dot.mark), mark_colour);
  }
  for (const IslandDot& dot : frame.islands) {
    outline(picture, dot.dot, island_colour);
    label(picture, dot.dot.centre_px, fmt::format("#{} {}", dot.island, name_of(dot.dot.mark)),
          island_colour);
  }
  for (const Rejection& rejection : frame.rejections) {
    if (!rejection.centre_px) continue;
    cv::drawMarker(picture, at(*rejection.centre_px), reject_colour, cv::MARKER_TILTED_CROSS, 12,
                   1);
    const std::string kind = rejection.reason.substr(0, rejection.reason.find(':'));
    label(picture, *rejection.centre_px,
          rejection.mark ? name_of(*rejection.mark) + " " + kind : kind, reject_colour);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  return bytes;
}

}  // namespace drape

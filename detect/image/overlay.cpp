// SPDX-License-Identifier: Apache-2.0
#include "detect/image/overlay.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "core/units.hpp"

namespace drape::detect {
namespace {

const cv::Scalar tag_colour(255, 140, 0);
const cv::Scalar mark_colour(60, 220, 60);
const cv::Scalar island_colour(40, 220, 255);
const cv::Scalar reject_colour(60, 60, 255);

cv::Point at(const Eigen::Vector2d& px) {
  return {static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y()))};
}

/// Draws captions that do not overlap: each is put at the first free place around its point, with a
/// line to the point if that is far away; if no place is free, beside the point.
class Captions {
 public:
  explicit Captions(cv::Mat& picture) : picture_(picture) {}

  /// Keeps captions off measured marks.
  void keep_free(const Eigen::Vector2d& px, double radius_px) {
    const int r = static_cast<int>(std::ceil(radius_px));
    taken_.emplace_back(at(px) - cv::Point(r, r), cv::Size(2 * r + 1, 2 * r + 1));
  }

  void write(const Eigen::Vector2d& px, const std::string& text, const cv::Scalar& colour) {
    int below = 0;
    const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &below);
    const cv::Point point = at(px);
    const cv::Rect place = place_for(point, cv::Size(size.width, size.height + below));
    taken_.push_back(place);
    const cv::Point start(place.x, place.y + size.height);
    const cv::Point middle(place.x + place.width / 2, place.y + place.height / 2);
    const int far = std::abs(middle.y - point.y);
    if (far > 2 * place.height) cv::line(picture_, point, middle, colour, 1, cv::LINE_AA);
    // A dark outline keeps the letters readable on cloth and table.
    cv::putText(picture_, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, cv::Scalar(0, 0, 0), 3,
                cv::LINE_AA);
    cv::putText(picture_, text, start, cv::FONT_HERSHEY_SIMPLEX, scale, colour, 1, cv::LINE_AA);
  }

 private:
  static constexpr double scale = 0.4;

  [[nodiscard]] cv::Rect place_for(const cv::Point& point, const cv::Size& size) const {
    const cv::Rect whole(0, 0, picture_.cols, picture_.rows);
    const cv::Rect first(point.x + 9, point.y - size.height - 3, size.width, size.height);
    for (int away = 0; away < 8; ++away) {
      const int up = away * (size.height + 2);
      for (const cv::Point& corner :
           {cv::Point(first.x, first.y - up), cv::Point(first.x, point.y + 3 + up),
            cv::Point(point.x - 9 - size.width, first.y - up),
            cv::Point(point.x - 9 - size.width, point.y + 3 + up)}) {
        const cv::Rect place(corner, size);
        if ((place & whole) != place) continue;
        if (std::none_of(taken_.begin(), taken_.end(),
                         [&](const cv::Rect& other) { return (place & other).area() > 0; })) {
          return place;
        }
      }
    }
    return first;
  }

  cv::Mat& picture_;
  std::vector<cv::Rect> taken_;
};

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
  cv::Mat picture;
  cv::cvtColor(view_of(image), picture, cv::COLOR_GRAY2BGR);
  for (const TagDetection& tag : frame.tags) {
    for (int k = 0; k < 4; ++k) {
      cv::line(picture, at(tag.corners_px.col(k)), at(tag.corners_px.col((k + 1) % 4)), tag_colour,
               2, cv::LINE_AA);
    }
  }
  struct Drawn {
    const Detection& dot;
    std::string name;
    const cv::Scalar& colour;
  };
  std::vector<Drawn> marks;
  for (const Detection& dot : frame.detections)
    marks.push_back({dot, name_of(dot.mark), mark_colour});
  for (const IslandDot& dot : frame.islands)
    marks.push_back(
        {dot.dot, fmt::format("#{} {}", dot.island, name_of(dot.dot.mark)), island_colour});
  Captions captions(picture);
  for (const Drawn& mark : marks) {
    outline(picture, mark.dot, mark.colour);
    captions.keep_free(mark.dot.centre_px, 0.7 * mark.dot.semi_axes_px.x());
  }
  std::vector<Rejection> seen = frame.rejections;
  std::erase_if(seen, [](const Rejection& rejection) { return !rejection.centre_px; });
  for (const Rejection& rejection : seen) {
    cv::drawMarker(picture, at(*rejection.centre_px), reject_colour, cv::MARKER_TILTED_CROSS, 12,
                   1);
    captions.keep_free(*rejection.centre_px, 5);
  }
  for (const Drawn& mark : marks) captions.write(mark.dot.centre_px, mark.name, mark.colour);
  for (const Rejection& rejection : seen) {
    const std::string kind = rejection.reason.substr(0, rejection.reason.find(':'));
    captions.write(*rejection.centre_px,
                   rejection.mark ? name_of(*rejection.mark) + " " + kind : kind, reject_colour);
  }
  std::vector<unsigned char> bytes;
  cv::imencode(".png", picture, bytes);
  return bytes;
}

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/light_growth.hpp"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace drape::detect {

GreyImage with_light_grown(const GreyImage& image, int by_px) {
  // A view without a copy; OpenCV only reads it.
  const cv::Mat from(image.height_px, image.width_px, CV_8UC1,
                     const_cast<std::uint8_t*>(image.bytes.data()));
  GreyImage grown;
  grown.width_px = image.width_px;
  grown.height_px = image.height_px;
  grown.bytes.resize(image.bytes.size());
  cv::Mat to(image.height_px, image.width_px, CV_8UC1, grown.bytes.data());
  const int side = 2 * by_px + 1;
  cv::dilate(from, to, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  return grown;
}

Eigen::Matrix<double, 2, 4> without_growth(const Eigen::Matrix<double, 2, 4>& corners_px,
                                           int by_px) {
  const Eigen::Vector2d middle = corners_px.rowwise().mean();
  Eigen::Matrix<double, 3, 4> lines;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = corners_px.col(k), along = corners_px.col((k + 1) % 4) - a;
    Eigen::Vector2d outwards = Eigen::Vector2d(along.y(), -along.x()).normalized();
    if (outwards.dot(a - middle) < 0) outwards = -outwards;
    lines.col(k) << outwards, -outwards.dot(a) - by_px * outwards.lpNorm<1>();
  }
  Eigen::Matrix<double, 2, 4> corners;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d before = lines.col((k + 3) % 4), after = lines.col(k);
    corners.col(k) = before.cross(after).hnormalized();
  }
  return corners;
}

}  // namespace drape::detect

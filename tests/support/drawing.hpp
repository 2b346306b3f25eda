// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace drape::test {

/// A grey picture of shapes with outlines known in pixels (centre of the first at 0): each pixel is
/// the mean of 8 x 8 points, then blurred as by a lens.
class Drawing {
 public:
  Drawing(int width_px, int height_px, int grey);
  /// Fills a convex polygon.
  void polygon(const std::vector<Eigen::Vector2d>& corners_px, int grey);
  void ellipse(const Eigen::Vector2d& centre_px, const Eigen::Vector2d& semi_axes_px,
               double angle_deg, int grey);
  [[nodiscard]] cv::Mat picture(double blur_px) const;

 private:
  cv::Mat fine_;
};

/// Draws the 13 pairs of a chessboard from the corners that OpenCV 4.6 found in Bouguet's
/// photographs (tests/data/stereo-chessboard) into `folder`: left01.png, right01.png and so on;
/// only the first `cols` of its 9 columns of corners.
void draw_stereo_chessboard(const std::filesystem::path& folder, int cols = 9);

}  // namespace drape::test

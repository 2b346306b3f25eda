// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "core/marks.hpp"
#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::test {

using namespace detect;

/// How a drawn cloth hangs and is seen, for tests of failure cases: a generalised cylinder, bent
/// along the weft only, under a camera far above it. Millimetres of the print to pixels.
struct ClothView {
  int width_px = 700, height_px = 700;
  double px_per_mm =
      4.93;             ///< no simple ratio: samples must not fall on the edges of the ink cells
  double turn_rad = 0;  ///< of the patch in the picture
  double squeeze = 1;   ///< of the warp direction, as by a tilted view
  double kappa_per_px2 = 0;  ///< lens: undistorted = distorted (1 + kappa r^2) about the middle
  double blur_px = 0.6;
  double bright = 180, dark = 45;
  double noise = 1.5;
  double light_slope_per_px = 0;
  /// Slope angle of the cloth by the distance along the weft, mm; over 90 degrees it overhangs.
  std::function<double(double)> slope_rad = [](double) { return 0.0; };
  /// Changes the light at a pixel: shadows, highlights, weave.
  std::function<double(double, double)> light = [](double, double) { return 1.0; };
};

/// A cloth with its print, drawn with sixteen samples per pixel.
class ClothPicture {
 public:
  ClothPicture(const Print& print, const ClothView& view);

  /// Paints the print white (or a disc of ink) around a place of the print, before drawing.
  void wipe(const Eigen::Vector2d& at_mm, double radius_mm);
  void stain(const Eigen::Vector2d& at_mm, double radius_mm);
  /// Mirrors the square of the print around a place, as a misprinted tag.
  void mirror(const Eigen::Vector2d& at_mm, double half_edge_mm);

  [[nodiscard]] GreyImage draw() const;

  /// Where a mark is seen; nothing when the cloth hides it (its whole dot, by more than a quarter).
  [[nodiscard]] std::optional<Eigen::Vector2d> seen_px(MarkId mark) const;
  /// Position of a mark on the print, mm along (weft, warp).
  [[nodiscard]] Eigen::Vector2d place_mm(MarkId mark) const;

 private:
  [[nodiscard]] std::optional<Eigen::Vector2d> place_at(const Eigen::Vector2d& px) const;
  [[nodiscard]] Eigen::Vector2d to_px(double along_mm, double warp_mm) const;

  Print print_;
  ClothView view_;
  Eigen::Matrix2d turn_;
  int side_x_ = 0, side_y_ = 0;
  std::vector<unsigned char> ink_;  ///< ink_per_mm samples a mm: 1 printed
  std::vector<double> along_mm_;    ///< picture coordinate by distance along the weft
  std::vector<double> height_mm_;
  std::vector<double> front_mm_;  ///< uppermost weft distance by picture coordinate; -1: none
  double first_along_mm_ = 0;
};

}  // namespace drape::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <random>

#include "detect/detect.hpp"

// Drawn pictures with known truth, for the tests of detection.
namespace drape::test {

using namespace detect;

/// Draws a picture of `width_px` x `height_px` with light `level` at each point; each pixel is the
/// mean of `samples` x `samples` points.
[[nodiscard]] cv::Mat sampled(int width_px, int height_px, int samples,
                              const std::function<double(const Eigen::Vector2d&)>& level);
/// The camera's picture of it: blurred by the lens, with noise, rounded to grey levels.
[[nodiscard]] GreyImage exposed(const cv::Mat& light, double blur_px, double noise_grey,
                                unsigned seed);
/// An 8-bit picture in the form that detection uses.
[[nodiscard]] GreyImage image_of(const cv::Mat& picture);

/// A drawn dot with known centre, for the tests of the fit.
struct SyntheticDot {
  Eigen::Vector2d centre_px{32, 32};
  Eigen::Matrix2d shape_px2 = 64.0 * Eigen::Matrix2d::Identity();
  double bright = 190;
  double contrast = 120;
  double slope_per_px = 0;    ///< relative change of the light along u
  double lens_blur_px = 0.6;  ///< Gaussian sigma before the pixel's own extent
  double noise = 2;           ///< grey levels
  int bits = 8;               ///< depth of a pixel
  /// Variance of rounding, grey levels squared.
  [[nodiscard]] double rounding() const { return std::ldexp(1.0 / 12, 2 * (8 - bits)); }
  double texture = 0;          ///< rms of a weave in grey levels of the bright cloth, 1 px long
  double hidden_from_u = 1e9;  ///< unprinted cloth covers the dot beyond this u
};

/// 64x64 picture: exact coverage of each pixel, Gaussian blur, light, noise, rounding.
[[nodiscard]] GreyImage draw(const SyntheticDot& dot, std::mt19937& random);

/// Initial values of the fit as from a perfect threshold, off by a third of a pixel.
[[nodiscard]] Blob blob_of(const SyntheticDot& dot);

/// Shape and view of a drawn cloth for tests of failure cases: a generalised cylinder, bent along
/// the weft only, under a distant camera. Converts millimetres of the print to pixels.
struct ClothView {
  int width_px = 700, height_px = 700;
  double px_per_mm = 4.93;   ///< not a simple ratio, so that samples miss the edges of ink cells
  double turn_rad = 0;       ///< rotation of the patch in the picture
  double squeeze = 1;        ///< foreshortening of the warp direction, as in a tilted view
  double kappa_per_px2 = 0;  ///< lens: undistorted = distorted (1 + kappa r^2) about the centre
  double blur_px = 0.6;
  double bright = 180, dark = 45;
  double noise = 1.5;
  /// Slope angle as a function of distance along the weft, mm; above 90 degrees it overhangs.
  std::function<double(double)> slope_rad = [](double) { return 0.0; };
  /// Factor of the light at a pixel: shadows, highlights, weave.
  std::function<double(double, double)> light = [](double, double) { return 1.0; };
};

/// A cloth with its print, drawn with sixteen samples per pixel.
class ClothPicture {
 public:
  ClothPicture(const Print& print, const ClothView& view);

  /// Paints a disc of the print white or black around a position, before drawing.
  void wipe(const Eigen::Vector2d& at_mm, double radius_mm) { paint(at_mm, radius_mm, 0); }
  void stain(const Eigen::Vector2d& at_mm, double radius_mm) { paint(at_mm, radius_mm, 1); }
  /// Mirrors the square of the print around a position, like a misprinted tag.
  void mirror(const Eigen::Vector2d& at_mm, double half_edge_mm);

  [[nodiscard]] GreyImage draw() const;

  /// Image of a mark; nullopt if the cloth hides its dot by more than a quarter.
  [[nodiscard]] std::optional<Eigen::Vector2d> seen_px(MarkId mark) const;
  /// Position of a mark on the print, mm along (weft, warp).
  [[nodiscard]] Eigen::Vector2d place_mm(MarkId mark) const;

 private:
  void paint(const Eigen::Vector2d& at_mm, double radius_mm, int ink);
  [[nodiscard]] std::optional<Eigen::Vector2d> place_at(const Eigen::Vector2d& px) const;
  [[nodiscard]] Eigen::Vector2d to_px(double along_mm, double warp_mm) const;

  Print print_;
  ClothView view_;
  Eigen::Matrix2d turn_;
  int side_x_ = 0, side_y_ = 0;
  std::vector<unsigned char> ink_;  ///< ink_per_mm samples a mm: 1 printed
  std::vector<double> along_mm_;    ///< picture coordinate as a function of distance along the weft
  std::vector<double> front_mm_;    ///< uppermost weft distance per picture coordinate; -1 if none
  double first_along_mm_ = 0;
};

inline constexpr int side = 6;
inline constexpr int all = side * side;

/// 6 x 6 dots of 4 mm at 20 mm, tags of 12 mm in every other cell.
[[nodiscard]] Print small_print(bool classes = false, bool tags = true);

/// Marks found in a picture, compared with where they were drawn.
struct Look {
  FrameDetections frame;
  int right = 0, wrong = 0, visible = 0;
  double worst_px = 0;  ///< largest error of the right ones
};

[[nodiscard]] FrameDetections detected(const GreyImage& image, const Print& print,
                                       double* blur_px = nullptr);
[[nodiscard]] Look judged(FrameDetections frame, const ClothPicture& picture);
[[nodiscard]] Look look_at(const ClothPicture& picture, const Print& print);

/// Reason of the rejection nearest to a position in the picture; empty if none within 10 px.
[[nodiscard]] std::string reason_at(const FrameDetections& frame, const Eigen::Vector2d& px);

[[nodiscard]] bool has(const FrameDetections& frame, MarkId mark);

}  // namespace drape::test

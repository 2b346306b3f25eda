// SPDX-License-Identifier: Apache-2.0
// Compares the fit with OpenCV's cornerSubPix on rendered corners with blur and noise.
#include "detect/targets/board.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "detect/test_pictures.hpp"
#include "tests/support/trials.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;

constexpr int kSide_px = 41;

/// A drawn corner: two edges that cross at `centre` at an angle of at least 35 degrees, blurred,
/// with a gradient of the light and noise, rounded to whole grey levels.
struct DrawnCorner {
  GreyImage image;
  Vector2d centre_px;
};

DrawnCorner drawn_corner(double blur_px, double noise_levels, std::mt19937& random) {
  constexpr int kFine = 6;
  std::uniform_real_distribution<double> unit(0, 1);
  const double first = std::numbers::pi * unit(random);
  const double second = first + std::numbers::pi * (0.2 + 0.6 * unit(random));
  const double dark = 20 + 40 * unit(random), light = 140 + 80 * unit(random);
  const Vector2d slope = Vector2d(unit(random) - 0.5, unit(random) - 0.5) * 0.004;
  DrawnCorner drawn;
  drawn.centre_px =
      Vector2d::Constant((kSide_px - 1) / 2.0) + Vector2d(unit(random) - 0.5, unit(random) - 0.5);
  const cv::Mat levels = test::sampled(kSide_px, kSide_px, kFine, [&](const Vector2d& px) {
    const Vector2d p = px - drawn.centre_px;
    const double a = std::cos(first) * p.y() - std::sin(first) * p.x();
    const double b = std::cos(second) * p.y() - std::sin(second) * p.x();
    return (a * b > 0 ? light : dark) * (1 + slope.dot(p));
  });
  drawn.image = test::exposed(levels, blur_px, noise_levels, static_cast<unsigned>(random()));
  return drawn;
}

Vector2d by_opencv(const DrawnCorner& drawn, const Vector2d& start, int half_window) {
  std::vector<cv::Point2f> corner{{static_cast<float>(start.x()), static_cast<float>(start.y())}};
  cv::cornerSubPix(view_of(drawn.image), corner, {half_window, half_window}, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4});
  return {corner[0].x, corner[0].y};
}

/// Sums of squared errors, px^2, of corners of one kind.
struct Errors {
  double ours = 0, opencv = 0, stated = 0;
  int corners = 0, fitted = 0;
};

Errors errors_of(int half_window, double blur_px, double noise, int corners) {
  Errors errors;
  std::mt19937 random(
      static_cast<unsigned>(half_window * 1000 + std::lround(100 * blur_px + noise)));
  std::uniform_real_distribution<double> off(-0.7, 0.7);
  for (int i = 0; i < corners; ++i) {
    const DrawnCorner drawn = drawn_corner(blur_px, noise, random);
    const Vector2d start = drawn.centre_px + Vector2d(off(random), off(random));
    const auto point = find_corner_point(drawn.image, start, half_window);
    if (!point) continue;
    ++errors.corners;
    errors.ours += (point->centre_px - drawn.centre_px).squaredNorm();
    errors.opencv += (by_opencv(drawn, start, half_window) - drawn.centre_px).squaredNorm();
    if (const auto fit = fit_saddle(drawn.image, start, half_window + 0.5)) {
      ++errors.fitted;
      errors.stated += noise * noise * fit->normal_matrix.inverse().trace();
    }
  }
  return errors;
}

// The limit is 0.9 times the error of cornerSubPix, with the same start and window.
TEST(SaddleFit, IsAtMostNineTenthsOfCornerSubPixOffOnBlurredNoisyCorners) {
  const int corners = test::trial_count(4, 200);
  for (const int half_window : {4, 6, 10}) {
    double ratios = 0;
    int kinds = 0;
    for (const double blur_px : {0.5, 0.8, 1.2, 2.0}) {
      for (const double noise : {1.0, 3.0, 6.0}) {
        const Errors errors = errors_of(half_window, blur_px, noise, corners);
        ASSERT_GT(errors.corners, 0);
        const double ratio = std::sqrt(errors.ours / errors.opencv);
        std::printf(
            "window %d px, blur %.1f px, noise %.0f: %d corners, %.4f px, cornerSubPix "
            "%.4f px, ratio %.2f; fitted %d, stated %.4f px\n",
            half_window, blur_px, noise, errors.corners, std::sqrt(errors.ours / errors.corners),
            std::sqrt(errors.opencv / errors.corners), ratio, errors.fitted,
            std::sqrt(errors.stated / std::max(errors.fitted, 1)));
        ratios += ratio;
        ++kinds;
        // Too few corners of one kind scatter too much to be judged separately.
        if (corners >= 100) {
          EXPECT_LE(ratio, 0.9);
        }
      }
    }
    EXPECT_LE(ratios / kinds, 0.9) << half_window;
  }
}

GreyImage after_jpeg(const GreyImage& image, int quality) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", view_of(image), bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return test::image_of(cv::imdecode(bytes, cv::IMREAD_GRAYSCALE));
}

// Mean square of the errors in units of the stated covariance, which JPEG correlates between
// neighbours. The tolerance is that of Chessboard.TheStatedUncertaintyIsThatOfTheErrors.
TEST(SaddleFit, StatesTheScatterOfItsErrorsWithAndWithoutJpeg) {
  const int corners = test::trial_count(24, 200);
  for (const int quality : {100, 95, 80}) {
    double squares = 0;
    int count = 0;
    std::mt19937 random(static_cast<unsigned>(quality));
    for (const double blur_px : {0.5, 0.8, 1.2}) {
      for (const double noise : {1.0, 3.0, 6.0}) {
        std::vector<CornerPoint> points;
        std::vector<Vector2d> errors;
        FrameDetections frame;
        for (int i = 0; i < corners; ++i) {
          const DrawnCorner drawn = drawn_corner(blur_px, noise, random);
          const auto point = find_corner_point(
              quality < 100 ? after_jpeg(drawn.image, quality) : drawn.image, drawn.centre_px, 9);
          if (!point) continue;
          points.push_back(*point);
          errors.emplace_back(point->centre_px - drawn.centre_px);
        }
        frame.detections.resize(points.size());
        set_corner_covariances(points, frame);
        for (std::size_t i = 0; i < points.size(); ++i)
          squares += errors[i].dot(frame.detections[i].covariance_px2.inverse() * errors[i]) / 2;
        count += static_cast<int>(points.size());
      }
    }
    EXPECT_GE(count, 9 * corners - 3);
    EXPECT_NEAR(squares / count, 1, 0.5) << quality;
    std::printf("JPEG quality %d: mean square %.2f of %d corners\n", quality, squares / count,
                count);
  }
}

TEST(SaddleFit, AnEdgeOrAFlatPatchIsNoCorner) {
  GreyImage flat{kSide_px, kSide_px, std::vector<std::uint8_t>(kSide_px * kSide_px, 128), {}};
  EXPECT_FALSE(find_corner_point(flat, {20, 20}, 6).has_value());
  GreyImage edge = flat;
  for (int y = 0; y < kSide_px; ++y)
    for (int x = 0; x < kSide_px; ++x)
      edge.bytes[static_cast<std::size_t>(y) * kSide_px + x] = x < 20 ? 40 : 200;
  EXPECT_FALSE(find_corner_point(edge, {20, 20}, 6).has_value());
  EXPECT_FALSE(fit_saddle(flat, {3, 3}, 6.5).has_value());
}

}  // namespace
}  // namespace drape::detect

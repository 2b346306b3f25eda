// SPDX-License-Identifier: Apache-2.0
#include "compare/folds/folds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace drape::compare {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

/// n x n points over a 400 mm square; the shape gives the point of a material point.
Sheet sheet_of(int n, const std::function<Eigen::Vector3d(double, double)>& shape) {
  Sheet sheet;
  sheet.rows = sheet.cols = n;
  sheet.patch_m = {0.4, 0.4};
  for (int row = 0; row < n; ++row) {
    for (int col = 0; col < n; ++col) {
      const double u = 0.4 * row / (n - 1), v = 0.4 * col / (n - 1);
      sheet.marks.push_back({{row, col}, {u, v}, shape(u, v), {}, {}, {}});
    }
  }
  return sheet;
}

TEST(Folds, WavesAreCountedPlacedAndMeasured) {
  // Four ridges along the weft, 100 mm apart, the first 50 mm from the edge; height 3 mm. The
  // normal warp x weft points down if warp is x and weft is y: a crest is a valley on that side.
  const double k = kTurn / 0.1;
  const Sheet sheet = sheet_of(
      81, [&](double u, double v) { return Eigen::Vector3d(v, u, 3e-3 * -std::cos(k * u)); });
  const SheetShape shape = shape_of(sheet).value();
  int crests = 0, valleys = 0;
  for (const Fold& fold : shape.folds) {
    EXPECT_NEAR(fold.direction_rad, std::numbers::pi / 2, 1e-6) << "along the weft";
    EXPECT_NEAR(fold.length_m, 0.39, 0.006) << "the rim has no curvature of its own";
    EXPECT_NEAR(std::abs(fold.curvature_per_m), 3e-3 * k * k, 0.03 * 3e-3 * k * k);
    const double phase = fold.middle_material_m.x() / 0.1;
    const bool crest = std::abs(phase - std::floor(phase) - 0.5) < 0.1;
    EXPECT_EQ(fold.curvature_per_m < 0, crest);
    (crest ? crests : valleys) += 1;
  }
  EXPECT_EQ(crests, 4);
  EXPECT_EQ(valleys, 3);
}

TEST(Folds, ACrestIsOneLineInAnyDirection) {
  for (int degrees = 0; degrees < 180; degrees += 7) {
    const Eigen::Vector2d across(std::cos(degrees * kTurn / 360), std::sin(degrees * kTurn / 360));
    const auto phase = [&](const Eigen::Vector2d& at) { return across.dot(at) / 0.1; };
    const Sheet sheet = sheet_of(31, [&](double u, double v) {
      return Eigen::Vector3d(v, u, 3e-3 * -std::cos(kTurn * phase({u, v})));
    });
    std::map<long, int> lines;  // in half waves: crests are odd
    const SheetShape shape = shape_of(sheet).value();
    for (const Fold& fold : shape.folds) lines[std::lround(2 * phase(fold.middle_material_m))] += 1;
    for (const auto& [half_wave, count] : lines)
      EXPECT_EQ(count, 1) << degrees << " degrees, half wave " << half_wave;
    EXPECT_GE(lines.size(), 6U) << degrees;
  }
}

TEST(Folds, ThePowerLiesInTheBandOfTheWavelengthAndSumsToTheVariance) {
  // A cosine that is a single mode of the transform: 8 half waves over the patch of n steps.
  constexpr int kPoints = 64;
  const double step = 0.4 / (kPoints - 1);
  const double wavelength = 2 * kPoints * step / 8;
  const Sheet sheet = sheet_of(kPoints, [&](double u, double v) {
    return Eigen::Vector3d(v, u, 2e-3 * std::cos(kTurn * (u + step / 2) / wavelength));
  });
  const SheetShape shape = shape_of(sheet).value();
  double total = 0;
  for (const WaveBand& band : shape.bands) {
    total += band.height_m2;
    const bool holds = wavelength >= band.from_m && wavelength < band.to_m;
    EXPECT_NEAR(band.height_m2, holds ? 2e-6 : 0, 1e-12) << band.from_m;
  }
  EXPECT_NEAR(total, 2e-6, 1e-12);
}

TEST(Folds, ACylinderIsBentEverywhereAlike) {
  const double radius = 0.2;
  const Sheet sheet = sheet_of(41, [&](double u, double v) {
    return Eigen::Vector3d(v, radius * std::sin(u / radius), radius * std::cos(u / radius));
  });
  const SheetShape shape = shape_of(sheet).value();
  // Chords of 10 mm on 200 mm: central differences are short by (h / R)^2 / 12 and the metric by
  // (h / R)^2 / 6.
  EXPECT_NEAR(shape.mean_bending_per_m2, 1 / (radius * radius), 2e-3 / (radius * radius));
  for (const WaveBand& band : shape.bands) EXPECT_LT(band.curvature_per_m2, 1e-12);
}

TEST(Folds, AskForAWholeGridAtEqualSteps) {
  Sheet sheet = sheet_of(9, [](double u, double v) { return Eigen::Vector3d(v, u, 0); });
  ASSERT_TRUE(shape_of(sheet));
  EXPECT_TRUE(shape_of(sheet)->folds.empty());
  sheet.marks[7].material_m.x() += 1e-3;
  EXPECT_FALSE(shape_of(sheet)) << "uneven";
  sheet.marks.pop_back();
  EXPECT_FALSE(shape_of(sheet)) << "torn";
}

TEST(Folds, ASheetThatLiesOnItselfHasTheCurvatureOfItsTurn) {
  // Folded back at half its length within one step of the grid: a rotation by pi over two steps.
  constexpr int kPoints = 41;
  const double step = 0.4 / (kPoints - 1), middle = 0.2;
  const Sheet sheet = sheet_of(kPoints, [&](double u, double v) {
    return Eigen::Vector3d(v, u < middle ? u : 2 * middle - u, u < middle ? 0 : 1e-9);
  });
  const SheetShape shape = shape_of(sheet).value();
  EXPECT_LE(std::sqrt(shape.mean_bending_per_m2), 2 / step);
}

TEST(Folds, DescriptorsFollowTheHeightOfWaves) {
  for (const double height_mm : {2.7, 3.0, 4.5}) {
    const double k = kTurn / 0.1;
    const Sheet sheet = sheet_of(81, [&](double u, double v) {
      return Eigen::Vector3d(v, u, -height_mm * 1e-3 * std::cos(k * u));
    });
    std::map<std::string, double> found;
    for (const Descriptor& one : descriptors_of(shape_of(sheet).value()))
      found[one.name] = one.value;
    EXPECT_NEAR(found["height_sd_mm"], height_mm / std::sqrt(2.0), 0.01 * height_mm);
    EXPECT_NEAR(found["rms_curvature_per_m"], height_mm * 1e-3 * k * k / std::sqrt(2.0),
                0.05 * height_mm * 1e-3 * k * k);
    EXPECT_EQ(found["folds"], 7);
    EXPECT_NEAR(found["curvature_wavelength_mm"], 100, 20) << "half an octave";
    EXPECT_NEAR(found["fold_length_mm"], 7 * 390, 42);
  }
}

}  // namespace
}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#include "compare/folds/folds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "compare/folds/folds_json.hpp"
#include "core/error.hpp"

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
  // normal warp x weft points down where warp is x and weft is y: a crest is a valley of that side.
  const double k = kTurn / 0.1;
  const Sheet sheet = sheet_of(
      81, [&](double u, double v) { return Eigen::Vector3d(v, u, 3e-3 * -std::cos(k * u)); });
  const SheetShape shape = shape_of(sheet, {}, "waves");
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
    std::map<long, int> lines;  // by half waves: crests are odd
    for (const Fold& fold : shape_of(sheet, {}, "waves").folds)
      lines[std::lround(2 * phase(fold.middle_material_m))] += 1;
    for (const auto& [half_wave, count] : lines)
      EXPECT_EQ(count, 1) << degrees << " degrees, half wave " << half_wave;
    EXPECT_GE(lines.size(), 6U) << degrees;
  }
}

TEST(Folds, ThePowerLiesInTheBandOfTheWavelengthAndSumsToTheVariance) {
  // A cosine that the transform has as one mode: 8 half waves over the patch of n steps.
  constexpr int kPoints = 64;
  const double step = 0.4 / (kPoints - 1);
  const double wavelength = 2 * kPoints * step / 8;
  const Sheet sheet = sheet_of(kPoints, [&](double u, double v) {
    return Eigen::Vector3d(v, u, 2e-3 * std::cos(kTurn * (u + step / 2) / wavelength));
  });
  const SheetShape shape = shape_of(sheet, {}, "wave");
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
  const SheetShape shape = shape_of(sheet, {}, "cylinder");
  // Chords of 10 mm on 200 mm: central differences are short by (h / R)^2 / 12 and the metric by
  // (h / R)^2 / 6.
  EXPECT_NEAR(shape.mean_bending_per_m2, 1 / (radius * radius), 2e-3 / (radius * radius));
  for (const WaveBand& band : shape.bands) EXPECT_LT(band.curvature_per_m2, 1e-12);
}

TEST(Folds, WhatIsNoWholeGridIsRefused) {
  Sheet sheet = sheet_of(9, [](double u, double v) { return Eigen::Vector3d(v, u, 0); });
  EXPECT_NO_THROW((void)shape_of(sheet, {}, "flat"));
  EXPECT_TRUE(shape_of(sheet, {}, "flat").folds.empty());
  sheet.marks[7].material_m.x() += 1e-3;
  EXPECT_THROW((void)shape_of(sheet, {}, "uneven"), Error);
  sheet.marks.pop_back();
  EXPECT_THROW((void)shape_of(sheet, {}, "torn"), Error);
}

TEST(Folds, AreaUnderTheCurveCountsPairs) {
  EXPECT_EQ(area_under_curve({1, 2}, {3, 4}), 1);
  EXPECT_EQ(area_under_curve({1, 2}, {1, 2}), 0.5);
  EXPECT_EQ(area_under_curve({1, 4}, {2, 3}), 0.5);
}

TEST(Folds, ACopyIsRefused) {
  const auto bent = [](double curvature) {
    return sheet_of(9,
                    [=](double u, double v) { return Eigen::Vector3d(v, u, curvature * u * u); });
  };
  EXPECT_NO_THROW(require_no_copies({{"a", bent(1)}, {"b", bent(2)}}));
  try {
    require_no_copies({{"a", bent(1)}, {"b", bent(2)}, {"c", bent(1)}});
    ADD_FAILURE() << "a copy is taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("that of a, a copy"), std::string::npos);
  }
}

TEST(Folds, TheTextSaysWhichGroupHasMore) {
  const DescriptorSpread spread{"rms_curvature_per_m", 31.01, {}, 28.22, {}, 0.0};
  EXPECT_EQ(text_of(spread), "31.01, against 28.22, which has more in 0.0 % of the pairs");
}

TEST(Folds, ASheetThatLiesOnItselfHasTheCurvatureOfItsTurn) {
  // Folded back at half its length within one step of the grid: a turn by pi over two steps.
  constexpr int kPoints = 41;
  const double step = 0.4 / (kPoints - 1), middle = 0.2;
  const Sheet sheet = sheet_of(kPoints, [&](double u, double v) {
    return Eigen::Vector3d(v, u < middle ? u : 2 * middle - u, u < middle ? 0 : 1e-9);
  });
  const SheetShape shape = shape_of(sheet, {}, "folded");
  EXPECT_LE(std::sqrt(shape.mean_bending_per_m2), 2 / step);
}

TEST(Folds, GroupsAreComparedByDescriptors) {
  // Waves of 100 mm whose height varies by a known part, against the same half as high again.
  const auto group = [](double factor) {
    std::vector<SheetShape> shapes;
    for (const double part : {0.9, 1.0, 1.1})
      shapes.push_back(shape_of(sheet_of(81,
                                         [&](double u, double v) {
                                           const double k = kTurn / 0.1;
                                           return Eigen::Vector3d(
                                               v, u, part * factor * 3e-3 * -std::cos(k * u));
                                         }),
                                {}, "waves"));
    return shapes;
  };
  const auto spread_of = [&](const std::string& name, const std::vector<DescriptorSpread>& all) {
    for (const DescriptorSpread& one : all)
      if (one.name == name) return one;
    ADD_FAILURE() << name;
    return DescriptorSpread{};
  };
  const std::vector<DescriptorSpread> spreads = spreads_of(group(1), group(1.5));
  const DescriptorSpread height = spread_of("height_sd_mm", spreads);
  EXPECT_NEAR(height.mean, 3 / std::sqrt(2.0), 0.03);
  EXPECT_NEAR(height.variation.value_or(0), 0.1, 1e-9);
  EXPECT_NEAR(height.mean_against.value_or(0), 1.5 * height.mean, 1e-9);
  EXPECT_EQ(height.area_under_curve, 1);
  EXPECT_NEAR(spread_of("rms_curvature_per_m", spreads).variation.value_or(0), 0.1, 0.01);
  EXPECT_EQ(spread_of("folds", spreads).mean, 7);
  EXPECT_EQ(spread_of("folds", spreads).area_under_curve, 0.5);
  EXPECT_NEAR(spread_of("curvature_wavelength_mm", spreads).mean, 100, 20) << "half an octave";
  const std::vector<DescriptorSpread> alone = spreads_of({group(1).front()}, {});
  EXPECT_FALSE(alone.front().variation);
  EXPECT_FALSE(alone.front().area_under_curve);
}

}  // namespace
}  // namespace drape::compare

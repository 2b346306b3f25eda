// SPDX-License-Identifier: Apache-2.0

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using units::mm;

constexpr double kTurn = 2 * std::numbers::pi;

/// Hem r = mean + sum of amplitude cos(order (angle - turn)).
struct Hem {
  double mean_m;
  std::vector<std::pair<int, double>> harmonics;
  double turn_rad = 0;

  [[nodiscard]] double at(double angle) const {
    double r = mean_m;
    for (const auto& [order, amplitude] : harmonics)
      r += amplitude * std::cos(order * (angle - turn_rad));
    return r;
  }
  [[nodiscard]] std::vector<double> radii(int n = 720) const {
    std::vector<double> r;
    r.reserve(n);
    for (int i = 0; i < n; ++i) r.push_back(at(kTurn * i / n));
    return r;
  }
};

TEST(Drapemeter, AreaAndCoefficientOfAnalyticHemsAreExact) {
  // A polygon of n vertices on the hem: n/2 sin(2 pi/n) (r0^2 + sum a_k^2/2 cos(2 pi k/n)).
  const Hem hem{0.12, {{7, 0.01}, {3, 0.004}}};
  const double n = 720;
  const double area = n / 2 * std::sin(kTurn / n) *
                      (0.12 * 0.12 + 0.5 * 0.01 * 0.01 * std::cos(kTurn * 7 / n) +
                       0.5 * 0.004 * 0.004 * std::cos(kTurn * 3 / n));
  const double flat = std::numbers::pi * 0.15 * 0.15, disc = std::numbers::pi * 0.09 * 0.09;
  const Drapemeter d = drapemeter_of(hem.radii(), flat, disc);
  EXPECT_NEAR(d.covered_area_m2, area, 1e-15);
  ASSERT_TRUE(d.drape_coefficient);
  EXPECT_NEAR(*d.drape_coefficient, (area - disc) / (flat - disc), 1e-12);
  EXPECT_NEAR(d.mean_radius_m, 0.12, 1e-15);
  EXPECT_FALSE(drapemeter_of(hem.radii(), flat, {}).drape_coefficient);
}

TEST(Drapemeter, FoldsAndDepthOfAnalyticHemsAreFound) {
  for (int folds = 2; folds <= 16; ++folds) {
    // Crests and valleys are on rays if 2 * folds divides the number of rays.
    const int rays = 2 * folds * 40;
    const Drapemeter d = drapemeter_of(Hem{0.1, {{folds, 0.008}}}.radii(rays), 0.07, {});
    EXPECT_EQ(d.folds, folds);
    EXPECT_NEAR(d.fold_depth_m, 0.016, 1e-12);
  }
}

TEST(Drapemeter, RipplesBelowTheThresholdAreNoFolds) {
  const Drapemeter d = drapemeter_of(Hem{0.1, {{5, 0.01}, {60, 0.0004}}}.radii(), 0.07, {});
  EXPECT_EQ(d.folds, 5);
  EXPECT_EQ(drapemeter_of(Hem{0.1, {}}.radii(), 0.07, {}).folds, 0);
  EXPECT_EQ(drapemeter_of(Hem{0.1, {}}.radii(), 0.07, {}).fold_depth_m, 0);
}

TEST(Drapemeter, SpectrumOfAnalyticHemsIsTheirAmplitudes) {
  const Drapemeter d =
      drapemeter_of(Hem{0.11, {{4, 0.02}, {9, 0.003}, {24, 0.001}}, 0.3}.radii(), 0.07, {});
  ASSERT_EQ(d.spectrum.size(), 24U);
  for (const Harmonic& harmonic : d.spectrum) {
    const double expected = harmonic.order == 4    ? 0.02
                            : harmonic.order == 9  ? 0.003
                            : harmonic.order == 24 ? 0.001
                                                   : 0;
    EXPECT_NEAR(harmonic.amplitude_m, expected, 1e-12) << harmonic.order;
  }
  EXPECT_NEAR(d.spectrum[3].phase_rad, 4 * 0.3, 1e-9);
}

/// A round cloth about (cx, cy): rows are rings, columns are rays, the last column closes it.
Sheet round_sheet(const Hem& hem, const Eigen::Vector2d& centre, int rays) {
  Sheet sheet;
  sheet.rows = 4;
  sheet.cols = rays + 1;
  sheet.patch_m = {0.3, 0.3};
  for (int row = 0; row < sheet.rows; ++row) {
    for (int col = 0; col <= rays; ++col) {
      const double angle = kTurn * col / rays;
      const double r = hem.at(angle) * (row + 1) / 4;
      sheet.marks.push_back(
          {{row, col},
           {0, 0},
           {centre.x() + r * std::cos(angle), centre.y() + r * std::sin(angle), 0},
           {},
           {},
           {}});
    }
  }
  return sheet;
}

TEST(Drapemeter, OutlineOfASheetIsItsHem) {
  const Hem hem{0.13, {{6, 0.015}}, 0.1};
  const Eigen::Vector2d centre(0.04, -0.02);
  const auto outline = shadow_outline(round_sheet(hem, centre, 720), centre, 720);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    ASSERT_TRUE(outline[i]) << i;
    EXPECT_NEAR(*outline[i], hem.at(kTurn * static_cast<double>(i) / 720), 1e-9) << i;
  }
}

TEST(Drapemeter, TheHemOfAFlatSquareIsTheSquare) {
  // The shadow of a flat square is the square: its outline at angle t is half / max(|cos|, |sin|).
  // With rays at the corners the polygon of the rays is the square itself.
  const Sheet sheet = test::simulated_sheet(23, 1);
  Scene scene;
  Box box;
  box.size_m = {0.1, 0.1, 0.05};
  scene.obstacles = {box};
  const DrapemeterResult result = drapemeter(sheet, scene);
  ASSERT_TRUE(result.value) << result.reason;
  EXPECT_NEAR(result.value->covered_area_m2, 0.22 * 0.22, 1e-12);
  EXPECT_NEAR(*result.value->drape_coefficient, 1, 1e-9);
  EXPECT_EQ(result.value->folds, 4) << "the corners of the square";
  EXPECT_NEAR(result.value->fold_depth_m, 0.11 * (std::sqrt(2.0) - 1), 1e-9);
}

TEST(Drapemeter, SaysWhyThereIsNone) {
  Scene scene;
  EXPECT_FALSE(drapemeter(test::simulated_sheet(5, 1), scene).reason.empty());
  scene.obstacles = {Sphere{{0, 0, 0}, 0.05}};
  Sheet torn = test::measured_sheet();
  torn.marks.erase(torn.marks.begin());
  EXPECT_FALSE(drapemeter(torn, scene).value);
  scene.obstacles = {Sphere{{1, 0, 0}, 0.05}};
  EXPECT_FALSE(drapemeter(test::simulated_sheet(5, 1), scene).value) << "cloth beside it";
  scene.obstacles = {Sphere{{0, 0, 0}, 0.05}};
  const DrapemeterResult over_sphere = drapemeter(test::simulated_sheet(5, 1), scene);
  ASSERT_TRUE(over_sphere.value);
  EXPECT_FALSE(over_sphere.value->drape_coefficient) << "a sphere has no flat top";
}

}  // namespace
}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
// Does the total uncertainty U hold the true mean distance? Benches at the level of points: a cloth
// whose shape answers to each value of scene and fabric in closed form, not in straight lines.
// Every source that the budget lists errs as it says: no picture is rendered and no cloth
// simulated.
#include "compare/tables/budget.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <random>

#include "compare/test_sheets.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMark_m = 0.03 * mm;         // as test::measured_sheet() states it
constexpr double kCalibration_m = 0.05 * mm;  // RMS in space, common to all marks
constexpr double kPlace_m = 0.5 * mm, kSize_m = 0.3 * mm, kFriction = 0.05;

/// What a virtual cloth rests on.
struct Values {
  Vector3d place_m = Vector3d::Zero();
  double size_m = 90 * mm;
  double friction = 0.4;
  double bending = 1, density = 1;           ///< by their true values
  double grid_error = 0, segment_error = 0;  ///< parts of the height
};

/// Cloth over a bump whose height and width answer to the values. Wider cloth where it is stiff or
/// slides little.
Vector3d cloth_at(const Vector2d& material_m, const Values& values) {
  const Vector3d flat = test::flat(material_m) - test::flat(Vector2d(0.11, 0.11));
  const double height_m = 0.5 * values.size_m * (1 + values.grid_error + values.segment_error) *
                          std::pow(values.density, -0.1);
  const double width_m =
      0.07 * (1 + 0.1 * std::log(values.bending) - 0.4 * std::expm1(values.friction - 0.4));
  const Vector2d away = (flat - values.place_m).head<2>() / width_m;
  return flat + Vector3d(0, 0, values.place_m.z() + height_m * std::exp(-0.5 * away.squaredNorm()));
}

/// The real drape differs from the virtual one in shape: folds of 3 mm.
Vector3d real_at(const Vector2d& material_m, const Values& truth) {
  return cloth_at(material_m, truth) +
         3 * mm *
             Vector3d(0, 0.3 * std::cos(40 * material_m.x()), 1 + std::sin(50 * material_m.y()));
}

struct Bench {
  Values truth, stated;
  double other_grid = 0, other_segments = 0;  ///< errors of the coarse grid and of one segment
  Sheet measured;
  Scene scene;
  FabricFacts fabric;
};

/// `stand_in`: nobody measured the bending curves; the true value lies within 50 % of the stated.
Bench some_bench(int seed, bool stand_in) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto within = [&](double half) {
    return std::uniform_real_distribution<double>(-half, half)(random);
  };
  Bench bench;
  bench.truth.place_m = Vector3d(within(10 * mm), within(10 * mm), 0);
  bench.truth.size_m += within(20 * mm);
  bench.truth.friction += within(0.1);
  bench.stated = bench.truth;
  for (double& place_m : bench.stated.place_m) place_m += kPlace_m * normal(random);
  bench.stated.size_m += kSize_m * normal(random);
  bench.stated.friction += kFriction * normal(random);
  bench.stated.density *= 1 + 0.05 * normal(random);
  const double standard = 0.05 * normal(random), rectangular = within(0.5);
  bench.stated.bending /= 1 + (stand_in ? rectangular : standard);
  if (stand_in) bench.fabric.stand_ins = {"bending curves"};
  constexpr double kGrid = 0.004, kSegments = 0.002;
  bench.stated.grid_error = within(kGrid);
  bench.other_grid = bench.stated.grid_error + (within(1) < 0 ? -kGrid : kGrid);
  bench.stated.segment_error = within(kSegments);
  bench.other_segments = bench.stated.segment_error + (within(1) < 0 ? -kSegments : kSegments);
  const Vector3d common_m =
      kCalibration_m / std::sqrt(3.0) * Vector3d(normal(random), normal(random), normal(random));
  bench.measured = test::measured_sheet([&](const Vector2d& m) -> Vector3d {
    return real_at(m, bench.truth) + common_m +
           kMark_m * Vector3d(normal(random), normal(random), normal(random));
  });
  bench.measured.error_budget = ErrorBudget{kMark_m, kCalibration_m, 0, kCalibration_m};
  bench.scene.obstacles = {Sphere{Vector3d::Zero(), 45 * mm}};
  bench.scene.uncertainties = {{kPlace_m, kSize_m, true}};
  bench.scene.friction = bench.stated.friction;
  bench.scene.friction_uncertainty = kFriction;
  return bench;
}

/// Mean distance of the marks from a cloth.
double mean_distance_m(const Sheet& sheet, const Values& values) {
  double sum = 0;
  for (const SheetMark& mark : sheet.marks)
    sum += (cloth_at(mark.material_m, values) - mark.point_in_world).norm();
  return sum / static_cast<double>(sheet.marks.size());
}

double true_distance_m(const Bench& bench) {
  double sum = 0;
  for (const SheetMark& mark : bench.measured.marks)
    sum += (cloth_at(mark.material_m, bench.truth) - real_at(mark.material_m, bench.truth)).norm();
  return sum / static_cast<double>(bench.measured.marks.size());
}

/// What drape sensitivity finds: central differences, by one per cent or by one standard
/// uncertainty.
ErrorSplitFile sensitivities_of(const Bench& bench) {
  const auto slope = [&](double step, const std::function<void(Values&, double)>& change) {
    Values up = bench.stated, down = bench.stated;
    change(up, step);
    change(down, -step);
    return (mean_distance_m(bench.measured, up) - mean_distance_m(bench.measured, down)) / 2;
  };
  ErrorSplitFile split;
  split.values = {
      {"bending_warp", slope(0.01, [](Values& v, double by) { v.bending *= 1 + by; }), 0},
      {"areal_density", slope(0.01, [](Values& v, double by) { v.density *= 1 + by; }), 0}};
  const auto add = [&](const std::string& name, double u, double unit,
                       const std::function<void(Values&, double)>& change) {
    split.scene.push_back({name, slope(u, change) / (u / unit)});
  };
  for (int axis = 0; axis < 3; ++axis)
    add(std::string("object_1_") + "xyz"[axis] + "_mm", kPlace_m, mm,
        [&](Values& v, double by) { v.place_m[axis] += by; });
  add("object_1_size_mm", kSize_m, mm, [](Values& v, double by) { v.size_m += by; });
  add("friction", kFriction, 1, [](Values& v, double by) { v.friction += by; });
  return split;
}

struct Found {
  double error_m = 0;
  Budget budget;
};

Found found_on(const Bench& bench) {
  const auto simulated = [&](int n, int segments, double grid_error, double segment_error) {
    Values values = bench.stated;
    values.grid_error = grid_error;
    values.segment_error = segment_error;
    return test::simulated_sheet(n, segments,
                                 [=](const Vector2d& m) { return cloth_at(m, values); });
  };
  const Values& stated = bench.stated;
  DrapeInput input =
      test::drape_of(bench.measured, {simulated(41, 5, stated.grid_error, stated.segment_error),
                                      simulated(31, 5, bench.other_grid, stated.segment_error),
                                      simulated(41, 1, stated.grid_error, bench.other_segments)});
  input.scene = bench.scene;
  const Report report = compare_drape(input, {});
  return {report.real_virtual.at(*report.headline).statistics.mean_m - true_distance_m(bench),
          budget_of(input, report, sensitivities_of(bench), bench.fabric)};
}

Budget without(Budget budget, const std::string& what) {
  std::erase_if(budget.lines, [&](const BudgetLine& line) { return line.what == what; });
  return budget;
}

struct Coverage {
  double inside = 0, mean_u_mm = 0, mean_error_mm = 0;
  std::map<std::string, double> without;  ///< the same with one source left out of the budget
};

Coverage coverage_of(int benches, bool stand_in) {
  Coverage all;
  for (int seed = 0; seed < benches; ++seed) {
    const Found found = found_on(some_bench(seed, stand_in));
    EXPECT_TRUE(found.budget.missing.empty());
    all.inside += (std::abs(found.error_m) <= found.budget.expanded_m()) / double(benches);
    all.mean_u_mm += found.budget.expanded_m() / mm / benches;
    all.mean_error_mm += found.error_m / mm / benches;
    for (const BudgetLine& line : found.budget.lines)
      all.without[line.what] +=
          (std::abs(found.error_m) <= without(found.budget, line.what).expanded_m()) /
          double(benches);
  }
  std::printf(
      "U holds the true mean distance on %.1f %% of %d benches%s; mean U %.3f mm, mean error "
      "%+.3f mm\n",
      100 * all.inside, benches, stand_in ? " with a stand-in" : "", all.mean_u_mm,
      all.mean_error_mm);
  for (const auto& [what, inside] : all.without)
    std::printf("  without %s: %.1f %%\n", what.c_str(), 100 * inside);
  return all;
}

TEST(TotalUncertainty, HoldsTheTrueMeanDistanceLessOftenWithoutASource) {
  const int benches = drape::test::trial_count(200, 500);
  const Coverage measured = coverage_of(benches, false);
  // Three standard deviations of a count of one in twenty. That U itself holds on 93 to 97 % is not
  // reached (docs/notebook/2026-11-23-truth.md).
  const double seen = 3 * std::sqrt(0.05 * 0.95 / benches);
  EXPECT_LT(measured.without.at("friction"), measured.inside - seen);
  EXPECT_LT(measured.without.at("object 1 z mm"), measured.inside - seen);
  static_cast<void>(coverage_of(benches, true));
}

}  // namespace
}  // namespace drape::compare

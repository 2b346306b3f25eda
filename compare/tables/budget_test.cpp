// SPDX-License-Identifier: Apache-2.0
// Does the total uncertainty U hold the true mean distance? Benches at the level of points: a cloth
// whose shape answers to each value of scene and fabric in closed form, not in straight lines.
// Every source that the budget lists errs as it says: no picture is rendered and no cloth
// simulated.

#include <cstdio>
#include <random>

#include "compare/tables/match.hpp"
#include "compare/test_sheets.hpp"
#include "tests/support/coverage.hpp"
#include "tests/support/trials.hpp"

namespace drape::compare {
namespace {

using drape::test::Coverage;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kMark_m = 0.03 * mm;         // as test::measured_sheet() states it
constexpr double kCalibration_m = 0.05 * mm;  // RMS in space, common to all marks
constexpr double kPlace_m = 0.5 * mm, kSize_m = 0.3 * mm, kFriction = 0.05;
constexpr double kLevel_rad = 0.06 * units::deg;
constexpr double kMesh = 0.004;  // part of the height that the mesh may leave

/// Scene of a virtual cloth.
struct Values {
  Vector3d place_m = Vector3d::Zero();
  double size_m = 90 * mm;
  double friction = 0.4;
  double bending = 1, density = 1;  ///< by their true values
  Vector2d level_rad = Vector2d::Zero();
  double mesh_error = 0, segment_error = 0;  ///< parts of the height
};

/// Cloth over a bump whose height and width answer to the values. Wider cloth where it is stiff or
/// slides little.
Vector3d cloth_at(const Vector2d& material_m, const Values& values) {
  const Vector3d flat = test::flat(material_m) - test::flat(Vector2d(0.11, 0.11));
  const double height_m = 0.5 * values.size_m * (1 + values.mesh_error + values.segment_error) *
                          std::pow(values.density, -0.1);
  const double width_m =
      0.07 * (1 + 0.1 * std::log(values.bending) - 0.4 * std::expm1(values.friction - 0.4));
  constexpr double kSlide_m = 0.2;  // on a bench that is not level, by a radian
  const Vector2d away = ((flat - values.place_m).head<2>() - kSlide_m * values.level_rad) / width_m;
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
  double other_segments = 0;  ///< error of one segment
  Sheet measured;
  Scene scene;
  bool stand_in = false;
  double mesh = kMesh;  ///< part of the height that the mesh may leave
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
  bench.stand_in = stand_in;
  bench.stated.level_rad = kLevel_rad * Vector2d(normal(random), normal(random));
  constexpr double kSegments = 0.002;
  bench.stated.mesh_error = within(kMesh);
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
  bench.scene.uncertainties = {{kPlace_m, kSize_m, {}, true}};
  bench.scene.friction = bench.stated.friction;
  bench.scene.friction_uncertainty = kFriction;
  return bench;
}

double true_distance_m(const Bench& bench) {
  double sum = 0;
  for (const SheetMark& mark : bench.measured.marks)
    sum += (cloth_at(mark.material_m, bench.truth) - real_at(mark.material_m, bench.truth)).norm();
  return sum / static_cast<double>(bench.measured.marks.size());
}

/// Result of drape simulate sensitivity: where the marks move by one per cent to first order, by
/// one standard uncertainty, and at the ends of a range.
SensitivityFile sensitivities_of(const Bench& bench) {
  SensitivityFile split;
  for (const SheetMark& mark : bench.measured.marks) split.marks_at.push_back(mark.mark);
  const auto by = [&](double step, const std::function<void(Values&, double)>& change) {
    Values other = bench.stated;
    change(other, step);
    Eigen::MatrixX3d moves_m(bench.measured.marks.size(), 3);
    for (Eigen::Index k = 0; k < moves_m.rows(); ++k) {
      const Vector2d& at = bench.measured.marks[static_cast<std::size_t>(k)].material_m;
      moves_m.row(k) = cloth_at(at, other) - cloth_at(at, bench.stated);
    }
    return moves_m;
  };
  const auto percent = [&](const std::function<void(Values&, double)>& change) {
    const Eigen::MatrixX3d up_m = 0.5 * (by(0.01, change) - by(-0.01, change));
    return MarkMoves{1, std::nullopt, -up_m, up_m};
  };
  const auto bending = [](Values& v, double part) { v.bending *= 1 + part; };
  split.values = {
      {"bending_warp", 0, 0,
       bench.stand_in ? MarkMoves{50, 50, by(-0.5, bending), by(0.5, bending)} : percent(bending)},
      {"areal_density", 0, 0, percent([](Values& v, double part) { v.density *= 1 + part; })}};
  const auto add = [&](const std::string& name, double u, double unit,
                       const std::function<void(Values&, double)>& change) {
    split.scene.push_back(
        {name, 0, MarkMoves{u / unit, std::nullopt, by(-u, change), by(u, change)}});
  };
  for (int axis = 0; axis < 3; ++axis)
    add(std::string("object_1_") + "xyz"[axis] + "_mm", kPlace_m, mm,
        [=](Values& v, double by_m) { v.place_m[axis] += by_m; });
  for (int axis = 0; axis < 2; ++axis)
    add(std::string("level_") + "xy"[axis] + "_deg", kLevel_rad, units::deg,
        [=](Values& v, double by_rad) { v.level_rad[axis] += by_rad; });
  add("object_1_size_mm", kSize_m, mm, [](Values& v, double by_m) { v.size_m += by_m; });
  add("friction", kFriction, 1, [](Values& v, double by_one) { v.friction += by_one; });
  add("curve_segments", 1, 1, [&](Values& v, double by_one) {
    v.segment_error += by_one * (bench.other_segments - bench.stated.segment_error);
  });
  return split;
}

struct Found {
  double mean_m = 0, error_m = 0;
  BudgetInputs inputs;

  [[nodiscard]] Match match(double limit_m) const {
    const Budget budget = budget_of(inputs);
    return decide(mean_m, budget.inputs_m + budget.own_m, limit_m);
  }
};

Found found_on(const Bench& bench) {
  const auto simulated = [&](int segments, double segment_error) {
    Values values = bench.stated;
    values.segment_error = segment_error;
    return test::mesh_sheet(2.5 * mm, segments,
                            [=](const Vector2d& m) { return cloth_at(m, values); });
  };
  DrapeInput input = test::drape_of(bench.measured, {simulated(5, bench.stated.segment_error),
                                                     simulated(1, bench.other_segments)});
  Values other_mesh = bench.stated;
  other_mesh.mesh_error += bench.mesh;
  LevelsFile levels = test::levels_of(bench.measured, 0);
  for (std::size_t k = 0; k < levels.marks.size(); ++k) {
    const Vector2d& at = bench.measured.marks[k].material_m;
    levels.marks[k].left_m = (cloth_at(at, other_mesh) - cloth_at(at, bench.stated)).norm();
  }
  input.simulations[0].levels = levels;
  input.scene = bench.scene;
  const Report report = compare_drape(input, {});
  const double mean_m = report.real_virtual.at(*report.headline).statistics.mean_m;
  return {mean_m, mean_m - true_distance_m(bench),
          budget_inputs_of(input, report, sensitivities_of(bench))};
}

/// Counts of the benches where U held the true mean distance.
struct Counts {
  Coverage far, near;                       ///< where d > 2 U; else
  std::map<std::string, Coverage> without;  ///< with one source left out of the budget
};

/// `left_out`: sources to do without.
Counts counts_of(int benches, bool stand_in, const std::vector<std::string>& left_out) {
  Counts all;
  double u_mm = 0, error_mm = 0;
  for (int seed = 0; seed < benches; ++seed) {
    const Found found = found_on(some_bench(drape::test::first_trial() + seed, stand_in));
    EXPECT_TRUE(found.inputs.missing.empty());
    const Budget budget = budget_of(found.inputs);
    const double expanded_m = budget.expanded_m;
    // What lengthens distances adds at most the distance to the root of squares, both times the
    // ratio of the coverage factors of a normal and a rectangular line.
    std::vector<BudgetLine> each = budget.lines;
    std::erase_if(each, [](const BudgetLine& line) {
      return line.what.ends_with("that lengthen every distance");
    });
    EXPECT_LE(expanded_m, 1.96 / 1.645 * std::hypot(half_width_m(each), found.mean_m)) << seed;
    EXPECT_GE(expanded_m, half_width_m(each)) << seed;
    (found.mean_m > 2 * expanded_m ? all.far : all.near).add(std::abs(found.error_m) <= expanded_m);
    u_mm += expanded_m / mm / benches;
    error_mm += found.error_m / mm / benches;
    for (const std::string& what : left_out) {
      BudgetInputs fewer = found.inputs;
      std::erase_if(fewer.effects, [&](const InputEffect& effect) { return effect.what == what; });
      EXPECT_EQ(fewer.effects.size() + 1, found.inputs.effects.size()) << what;
      all.without[what].add(std::abs(found.error_m) <= budget_of(fewer).expanded_m);
    }
  }
  std::printf("%d benches%s: mean U %.3f mm, mean error %+.3f mm\n", benches,
              stand_in ? " with a stand-in" : "", u_mm, error_mm);
  all.far.print("U holds the true mean, d > 2 U");
  all.near.print("U holds the true mean, else");
  for (const auto& [what, coverage] : all.without) coverage.print("without " + what);
  return all;
}

/// All values measured: 93 to 97 of 100. With a stand-in at least 93: near sheets count the worst
/// directions of errors (docs/missed.md), within the bound of counts_of().
TEST(TotalUncertainty, HoldsTheTrueMeanDistance) {
  // The figure of 3,000 benches has a standard deviation of 0.4 %.
  const int benches = drape::test::trial_count(60, 3000);
  const double slack = benches < 3000 ? 3 * std::sqrt(0.05 * 0.95 / benches) : 0;
  const auto part = [&](bool stand_in) {
    const Counts all = counts_of(benches, stand_in, {});
    return (all.far.inside + all.near.inside) / double(benches);
  };
  const double measured = part(false);
  EXPECT_GE(measured, 0.93 - slack);
  EXPECT_LE(measured, 0.97 + slack);
  EXPECT_GE(part(true), 0.93 - slack);
}

TEST(TotalUncertainty, HoldsItLessOftenWithoutASource) {
  const int benches = drape::test::trial_count(60, 500);
  const Counts measured = counts_of(benches, false, {"friction", "object 1 z mm"});
  EXPECT_LT(measured.without.at("friction").part(), 0.93);
  EXPECT_LT(measured.without.at("object 1 z mm").part(), 0.93);
  const Counts stand_in = counts_of(benches, true, {"bending warp"});
  EXPECT_LT(stand_in.without.at("bending warp").part(), 0.93);
}

/// The target's own error is a line beside the cameras' other errors, which together are what the
/// calibration gives.
TEST(TotalUncertainty, NamesTheCalibrationTargetsOwnError) {
  Bench bench = some_bench(3, false);
  const auto lines_of = [&](std::optional<double> target_m) {
    bench.measured.error_budget->target_m = target_m;
    std::map<std::string, double> lines;
    for (const BudgetLine& line : budget_of(found_on(bench).inputs).lines)
      lines[line.what] = line.u_m;
    return lines;
  };
  const auto whole = lines_of(std::nullopt), parts = lines_of(0.8 * kCalibration_m);
  EXPECT_EQ(whole.count("the calibration target's own error"), 0U);
  const double cameras_m = parts.at("calibration, common to all marks"),
               target_m = parts.at("the calibration target's own error");
  EXPECT_NEAR(target_m / cameras_m, 0.8 / 0.6, 0.02);
  EXPECT_NEAR(std::hypot(cameras_m, target_m) / whole.at("calibration, common to all marks"), 1,
              0.01);
}

/// Fewer marks or a coarser mesh make a match of none in less than 1 % of drawn cases: half of the
/// marks; twice the mesh's error and what it may leave; limits of half to twice the distance.
TEST(TotalUncertainty, MakesHardlyAMatchByFewerMarksOrACoarserMesh) {
  const int benches = drape::test::trial_count(20, 1500);
  int cases = 0, by_fewer = 0, by_coarser = 0;
  for (int seed = 0; seed < benches; ++seed) {
    const Bench bench = some_bench(drape::test::first_trial() + seed, seed % 2 == 1);
    std::mt19937 random(static_cast<unsigned>(seed));
    std::uniform_real_distribution<double> even(0, 1);
    Bench fewer = bench, coarser = bench;
    std::erase_if(fewer.measured.marks, [&](const SheetMark& mark) {
      if (even(random) >= 0.5) return false;
      fewer.measured.gaps.push_back({mark.mark, "seen by one camera"});
      return true;
    });
    coarser.mesh *= 2;
    coarser.stated.mesh_error *= 2;
    const Found own = found_on(bench), with_fewer = found_on(fewer), on_coarser = found_on(coarser);
    for (int k = 0; k < 4; ++k) {
      const double limit_m = (0.5 + 1.5 * even(random)) * own.mean_m;
      ++cases;
      if (own.match(limit_m) == Match::inside) continue;
      by_fewer += with_fewer.match(limit_m) == Match::inside;
      by_coarser += on_coarser.match(limit_m) == Match::inside;
    }
  }
  std::printf("a match by a coarser mesh: %d, by half of the marks: %d of %d\n", by_coarser,
              by_fewer, cases);
  EXPECT_LT(by_coarser, std::max(1.0, 0.01 * cases));
  EXPECT_LT(by_fewer, std::max(1.0, 0.01 * cases));
}

TEST(TotalUncertainty, OfSlopesAloneIsTheRootOfTheSquares) {
  // Far apart, by far more than the inputs move: the mean of norms is straight.
  const Eigen::MatrixX3d apart_m = Eigen::RowVector3d(0, 0, 1).replicate(50, 1);
  const auto line = [&](double u_m, bool rectangular) {
    const Eigen::MatrixX3d up_m = Eigen::RowVector3d(0, 0, u_m).replicate(50, 1);
    return BudgetLine{"", alone_m(apart_m, {"", "", rectangular, -up_m, up_m}), "", rectangular};
  };
  EXPECT_NEAR(line(3 * mm, false).u_m, 3 * mm, 1e-12);
  EXPECT_NEAR(line(3 * mm, true).u_m, std::sqrt(3.0) * mm, 1e-12);
  EXPECT_NEAR(half_width_m({line(3 * mm, false), line(4 * mm, false), line(12 * mm, false)}),
              1.96 * 13 * mm, 1e-9);
  EXPECT_NEAR(half_width_m({line(3 * mm, true)}), 0.95 * 3 * mm, 1e-6);
}

/// The exact 95 % points of sums: two rectangular variables of half widths a and b >= a hold 95 %
/// within a + b - sqrt(0.2 a b) where that is at least b - a (their sum is a trapezoid).
TEST(TotalUncertainty, HoldsRectangularContributionsTogether) {
  for (const double a : {0.3, 0.5, 0.7, 1.0}) {
    const double exact = a + 1 - std::sqrt(0.2 * a);
    const double found =
        half_width_m({{"", a / std::sqrt(3.0), "", true}, {"", 1 / std::sqrt(3.0), "", true}});
    EXPECT_NEAR(found / exact, 1, 0.01) << a;
  }
}

TEST(TotalUncertainty, OfSheetsThatCoincideIsWhatMovesThemApart) {
  // Slopes are zero where every distance is: the mean distance of what moves all marks alike is
  // |z| u, 95 of 100 of it below 1.96 u.
  const Eigen::MatrixX3d apart_m = Eigen::MatrixX3d::Zero(20, 3);
  const Eigen::MatrixX3d up_m = Eigen::RowVector3d(0, 2 * mm, 0).replicate(20, 1);
  EXPECT_NEAR(alone_m(apart_m, {"", "", false, -up_m, up_m}), 2 * mm, 1e-12);
}

/// The model is right, so that the true mean distance is 0 and all of the measured one is error:
/// errors of many inputs, each of which moves the marks around a place of its own.
TEST(TotalUncertainty, HoldsSheetsThatCoincideButForManyErrors) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  const auto direction = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  constexpr int kSide = 8, kDraws = 1000;
  for (const int count : {1, 3, 12, 30}) {
    BudgetInputs inputs;
    for (int i = 0; i < count; ++i) {
      const Vector3d at = 4 * direction() + Vector3d(3.5, 3.5, 0), way = 0.5 * mm * direction();
      Eigen::MatrixX3d up_m(kSide * kSide, 3);
      for (int k = 0; k < kSide * kSide; ++k)
        up_m.row(k) =
            way * std::exp(-0.1 * (Vector2d(k / kSide, k % kSide) - at.head<2>()).squaredNorm());
      inputs.effects.push_back({"", "", false, -up_m, up_m});
    }
    int within = 0, by_each = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      inputs.differences_m = Eigen::MatrixX3d::Zero(kSide * kSide, 3);
      for (const InputEffect& effect : inputs.effects)
        inputs.differences_m += normal(random) * effect.up_m;
      const double mean_m = inputs.differences_m.rowwise().norm().mean();
      within += mean_m <= budget_of(inputs).inputs_m;
      std::vector<BudgetLine> each;
      for (const InputEffect& effect : inputs.effects)
        each.push_back({"", alone_m(inputs.differences_m, effect), ""});
      by_each += mean_m <= half_width_m(each);
    }
    std::printf("%d errors of sheets that coincide: U holds %.1f %%, by each alone %.1f %%\n",
                count, 100.0 * within / kDraws, 100.0 * by_each / kDraws);
    EXPECT_GE(within / double(kDraws), 0.95 - 3 * std::sqrt(0.05 * 0.95 / kDraws)) << count;
  }
}

/// Errors of each mark by itself have as many degrees of freedom as the marks have coordinates.
TEST(TotalUncertainty, HoldsSheetsThatCoincideButForEachMarksError) {
  constexpr int kMarks = 100, kDraws = 400;
  std::mt19937 random(12);
  std::normal_distribution<double> normal(0, 0.1 * mm);
  int within = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    BudgetInputs inputs;
    inputs.marks_m = 0.1 * mm / std::sqrt(kMarks);
    inputs.differences_m = Eigen::MatrixX3d::NullaryExpr(kMarks, 3, [&] { return normal(random); });
    const double mean_m = inputs.differences_m.rowwise().norm().mean(),
                 inputs_m = budget_of(inputs).inputs_m;
    within += mean_m <= inputs_m;
    EXPECT_LE(inputs_m, 1.5 * mean_m);
  }
  EXPECT_GE(within, kDraws * (0.95 - 3 * std::sqrt(0.05 * 0.95 / kDraws)));
}

/// Errors across a distance add to its square: 3 mm across 4 mm make 5 mm.
TEST(TotalUncertainty, HoldsWhatErrorsLengthenADistanceBy) {
  EXPECT_NEAR(lengthened_m(5 * mm, 3 * mm), 1 * mm, 1e-12);
  EXPECT_EQ(lengthened_m(2 * mm, 3 * mm), 2 * mm) << "the sheets may coincide";
  EXPECT_NEAR(lengthened_m(100 * mm, 1 * mm), 0.005 * mm, 1e-6);
}

TEST(TotalUncertainty, HoldsNinetyFiveOfAHundredWhereOneRangeMovesSheetsThatLieNear) {
  // One rectangular input alone, which moves the marks by about as much as the sheets are apart.
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto rows = [&](double size_m) -> Eigen::MatrixX3d {
    return Eigen::MatrixX3d::NullaryExpr(30, 3, [&] { return size_m * normal(random); });
  };
  for (int bench = 0; bench < 40; ++bench) {
    const Eigen::MatrixX3d apart_m = rows(0.5 * mm), move_m = rows(0.2 * mm * (1 + bench % 5));
    const Eigen::MatrixX3d bend_m = bench % 2 == 0 ? rows(0.1 * mm) : rows(0);
    const InputEffect effect{"", "", true, bend_m - move_m, bend_m + move_m};
    const double width_m = half_width_m({{"", alone_m(apart_m, effect), "", true}});
    constexpr int kSteps = 2000;  // evenly over the range, not the product's own draws
    int within = 0;
    for (int k = 0; k < kSteps; ++k) {
      const double z = 2 * (k + 0.5) / kSteps - 1;
      const double mean_m = (apart_m + z * move_m + z * z * bend_m).rowwise().norm().mean();
      within += std::abs(mean_m - apart_m.rowwise().norm().mean()) <= width_m;
    }
    EXPECT_GE(within / double(kSteps), 0.95) << bench;
  }
}

}  // namespace
}  // namespace drape::compare

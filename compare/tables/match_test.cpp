// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/match.hpp"

#include <fmt/format.h>

#include <gmock/gmock.h>

#include <random>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using units::mm;

/// A cloth with a sagging centre, and waves by which one laying differs from another.
test::Shape sagging(double sag_m, double wave_m) {
  return [=](const Eigen::Vector2d& material_m) -> Eigen::Vector3d {
    const Eigen::Vector3d p = test::flat(material_m);
    const double off = p.head<2>().squaredNorm() / (0.01);
    return {p.x() * (1 + wave_m), p.y(), -sag_m * off + wave_m * std::sin(30 * p.x())};
  };
}

SheetFile repeat_of(double sag_m, double wave_m, const std::string& name) {
  Sheet sheet = test::measured_sheet(sagging(sag_m, wave_m));
  std::get<MeasuredSource>(sheet.source).set = "drape_" + name;
  SheetFile file = test::file_of(sheet);
  file.repeat = RepeatId{"A", name, "printed"};
  return file;
}

/// A drape with `layings` layings (including its own), and a simulation that sags by `sag_m`.
DrapeInput laid(int layings, double sag_m) {
  std::mt19937_64 lots(5);
  std::normal_distribution<double> normal;
  const auto draw = [&] { return 20 * mm + 1 * mm * normal(lots); };
  const auto wave = [&] { return 0.5 * mm * normal(lots); };
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(21, 5, sagging(sag_m, 0))});
  input.measured = repeat_of(draw(), wave(), "1");
  for (int i = 2; i <= layings; ++i)
    input.repeats.push_back(repeat_of(draw(), wave(), std::to_string(i)));
  return input;
}

/// Judged as by compare_session(), with open contributions from the inputs and the simulation.
Report judged(const DrapeInput& input, double inputs_m, double own_m = 0,
              std::optional<double> tolerance_m = {}) {
  Options options;
  options.max_sigma_ratio = 10;  // the drawn marks are uncertain relative to small distances
  options.tolerance_m = tolerance_m;
  Report report = compare_drape(input, options);
  report.budget = Budget{};
  report.budget->expanded_m = report.budget->inputs_m = inputs_m;
  report.budget->own_m = own_m;
  judge_repeats(input, options, report);
  judge_resolution(options, report);
  report.match = match_of(input, options, report);
  return report;
}

TEST(Match, OfADrapeWithRepeatsRestsOnThem) {
  const Report inside = judged(laid(8, 20 * mm), 0.01 * mm);
  EXPECT_EQ(inside.match.match, Match::inside) << inside.match.reason;
  EXPECT_EQ(inside.match.rests_on, "8 repeats");
  EXPECT_EQ(inside.match.bases.front().what, "repeats");
  EXPECT_GT(inside.real_virtual[0].statistics.mean_m, 0.01 * mm);
  EXPECT_NEAR(*inside.match.error_number, inside.real_virtual[0].statistics.mean_m / (0.01 * mm),
              1e-9);
  const Report outside = judged(laid(8, 40 * mm), 0.01 * mm);
  EXPECT_EQ(outside.match.match, Match::outside) << outside.match.reason;
  EXPECT_LT(*outside.among_repeats->matches[0].p, 0.05);
  EXPECT_EQ(outside.repeats.size(), 8U);
  EXPECT_FALSE(outside.repeats[0].from_own_m);
  EXPECT_GT(*outside.repeats[1].from_own_m, 0.1 * mm);
}

/// The limit is the distance at which the probability of one more repeat is the significance.
TEST(Match, LimitOfRepeatsIsWhereTheirProbabilityEnds) {
  for (const double sag_m : {20 * mm, 24 * mm, 40 * mm}) {
    const Report report = judged(laid(8, sag_m), 0);
    const MarkRepeats::SheetMatch& match = report.among_repeats->matches[0];
    const double limit = *limit_m(match, report.significance);
    EXPECT_EQ(*report.match.limit_m, limit);
    EXPECT_EQ(*report.match.value_m <= limit, *match.p >= report.significance) << sag_m;
    EXPECT_GT(*limit_m(match, 0.01), limit) << "fewer repeats lie as far out";
  }
}

TEST(Match, WithMoreOpenThanTheLimitLeavesIsUndecided) {
  for (const auto& [inputs_mm, own_mm] : {std::pair(100, 0), std::pair(0, 100)})
    for (const double sag_mm : {20, 40}) {
      const Report report = judged(laid(8, sag_mm * mm), inputs_mm * mm, own_mm * mm);
      EXPECT_EQ(report.match.match, Match::undecided) << sag_mm;
    }
}

TEST(Match, OfOneDrapeIsJudgedByTheTolerance) {
  const DrapeInput input = laid(1, 40 * mm);
  const double d = judged(input, 0).real_virtual[0].statistics.mean_m;
  EXPECT_EQ(judged(input, 0.1 * d, 0.1 * d, 1.21 * d).match.match, Match::inside);
  EXPECT_EQ(judged(input, 0.1 * d, 0.1 * d, 1.19 * d).match.match, Match::undecided);
  EXPECT_EQ(judged(input, 0.1 * d, 0.1 * d, 0.81 * d).match.match, Match::undecided);
  const Report outside = judged(input, 0.1 * d, 0.1 * d, 0.79 * d);
  EXPECT_EQ(outside.match.match, Match::outside);
  EXPECT_EQ(outside.match.rests_on, "tolerance");
  EXPECT_EQ(judged(laid(2, 40 * mm), 0, 0, 10 * d).match.rests_on, "tolerance")
      << "two layings do not say how far repeats lie apart";
  EXPECT_TRUE(outside.repeats.empty());
}

TEST(Match, WithoutALimitIsNone) {
  const Report report = judged(laid(1, 40 * mm), 0.01 * mm);
  EXPECT_EQ(report.match.match, Match::none);
  EXPECT_EQ(report.match.rests_on, "");
  EXPECT_FALSE(report.match.limit_m);
  EXPECT_THAT(report.match.remedies, testing::ElementsAre(HasSubstr("lay the cloth three times"),
                                                          HasSubstr("tolerance_mm")));
}

/// Judged with marks of 0.03 mm, raised by d, against a tolerance.
Report resolved(double d_m, std::optional<double> tolerance_m) {
  const DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(11, 5, test::raised(d_m))});
  Options options;
  options.tolerance_m = tolerance_m;
  Report report = compare_drape(input, options);
  report.budget = Budget{};
  report.budget->expanded_m = report.budget->inputs_m = 0.02 * mm;
  judge_resolution(options, report);
  report.match = match_of(input, options, report);
  return report;
}

/// A measurement is good or bad for what it decides: a small distance is no fault of it.
TEST(Match, MarksTooUncertainForTheLimitAreNoGo) {
  for (const double d_mm : {0.0, 0.001, 0.1, 0.29}) {
    const Report good = resolved(d_mm * mm, 0.31 * mm);
    EXPECT_EQ(good.match.match, Match::inside) << d_mm << ": " << good.match.reason;
    const Report bad = resolved(d_mm * mm, 0.29 * mm);
    EXPECT_THAT(bad.no_go, testing::ElementsAre(HasSubstr("above 10 % of the limit")));
    EXPECT_EQ(bad.match.match, Match::undecided) << d_mm;
    EXPECT_TRUE(resolved(d_mm * mm, {}).go()) << "nothing is decided, and U is given";
  }
  const Report far = resolved(0.31 * mm, 0.1 * mm);
  EXPECT_TRUE(far.go());
  EXPECT_EQ(far.match.match, Match::outside) << "far beyond the limit, finer marks change nothing";
}

TEST(Match, MarksTooUncertainForTheScatterOfRepeatsAreNoGo) {
  const Report good = judged(laid(8, 20 * mm), 0.01 * mm);
  ASSERT_TRUE(good.go());
  DrapeInput input = laid(8, 20 * mm);
  const double sigma_m = 11 * std::max(*good.match.limit_m, *good.match.value_m);
  for (SheetMark& mark : input.measured.sheet.marks)
    mark.covariance_m2 = Eigen::Matrix3d::Identity() * sigma_m * sigma_m;
  const Report bad = judged(input, 0.01 * mm);
  EXPECT_THAT(bad.no_go, testing::ElementsAre(HasSubstr("% of the limit")));
  EXPECT_EQ(bad.match.match, Match::undecided);
}

/// Contributions of a budget by name, each a standard uncertainty (mm), with a remedy if named.
Report with_lines(const DrapeInput& input, const std::vector<BudgetLine>& lines,
                  double tolerance_m) {
  Options options;
  options.tolerance_m = tolerance_m;
  Report report = compare_drape(input, options);
  Budget budget;
  budget.lines = lines;
  std::vector<BudgetLine> inputs;
  for (const BudgetLine& line : lines) {
    budget.own_m += line.own_m.value_or(0);
    if (!line.own_m) inputs.push_back(line);
  }
  budget.inputs_m = half_width_m(inputs);
  budget.expanded_m = half_width_m(lines);
  report.budget = budget;
  report.match = match_of(input, options, report);
  return report;
}

TEST(Match, NamesRemediesThatCouldChangeTheAnswerAlone) {
  const DrapeInput input = laid(1, 40 * mm);
  const double d = judged(input, 0).real_virtual[0].statistics.mean_m;
  const BudgetLine marks{"marks", 0.01 * d, ""};
  const BudgetLine friction{"friction", 0.2 * d, "", false, "measure friction", {}};
  const BudgetLine pin{"pin", 0.02 * d, "", false, "measure pin 1", {}};
  const BudgetLine mesh{"mesh", 0.05 * d, "", true, "`--spacing-mm 1.25`", 0.1 * d};
  const auto remedies = [&](const std::vector<BudgetLine>& lines, double part) {
    const Report report = with_lines(input, lines, part * d);
    EXPECT_EQ(report.match.match, Match::undecided);
    return report.match.remedies;
  };
  EXPECT_THAT(remedies({marks, friction, pin, mesh}, 1.3),
              testing::ElementsAre("measure friction"));
  EXPECT_THAT(remedies({marks, friction, pin, mesh}, 1.11),
              testing::ElementsAre("measure friction", "`--spacing-mm 1.25`"));
  EXPECT_THAT(remedies({marks, pin, mesh}, 1.12), testing::ElementsAre("`--spacing-mm 1.25`"));
  EXPECT_THAT(remedies({marks, pin, mesh}, 1.01),
              testing::ElementsAre(HasSubstr("lay the cloth three times")))
      << "nothing else leaves less open than a hundredth of the distance";
}

/// Differences, inputs and a limit from one seed; `more`: factor on one input's uncertainty.
Match drawn_match(unsigned seed, double more, bool coarser) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto rows = [&](double size_m) -> Eigen::MatrixX3d {
    return Eigen::MatrixX3d::NullaryExpr(8, 3, [&] { return size_m * normal(random); });
  };
  BudgetInputs inputs;
  inputs.marks_m = 0.02 * mm;
  inputs.differences_m = rows(std::exp(normal(random)) * mm);
  const double limit_m = inputs.differences_m.rowwise().norm().mean() * (1 + 0.5 * normal(random));
  for (int k = 0; k < 5; ++k) {
    const Eigen::MatrixX3d up_m = (k == 2 ? more : 1) * rows(0.2 * std::exp(normal(random)) * mm);
    inputs.effects.push_back({"input", "", k % 2 == 0, -up_m, up_m});
  }
  const Eigen::MatrixX3d left_m = (coarser ? more : 1) * rows(0.1 * mm);
  inputs.effects.push_back({"mesh", "", true, -left_m, left_m, "", left_m.rowwise().norm().mean()});
  const Budget budget = budget_of(inputs);
  return decide(inputs.differences_m.rowwise().norm().mean(), budget.inputs_m + budget.own_m,
                limit_m);
}

TEST(Match, IsNeverInsideByALargerUncertainty) {
  int counts[3] = {};
  for (unsigned seed = 0; seed < 5000; ++seed) {
    Match before = drawn_match(seed, 1, false);
    ++counts[static_cast<int>(before)];
    for (const double more : {1.01, 1.3, 2.0, 5.0, 20.0})
      for (const bool coarser : {false, true}) {
        const Match after = drawn_match(seed, more, coarser);
        if (before != Match::inside) {
          ASSERT_NE(after, Match::inside) << seed << " " << more;
        }
        if (before == Match::undecided) {
          ASSERT_EQ(after, Match::undecided) << seed << " " << more;
        }
      }
  }
  for (const int count : counts) EXPECT_GT(count, 500) << "all three answers are drawn";
}

TEST(Match, LeavesOutWhatIsNoRepeatAndSaysWhy) {
  DrapeInput input = laid(6, 20 * mm);
  input.repeats[0].repeat->face = "back";
  std::get<MeasuredSource>(input.repeats[1].sheet.source).calibration_sha256 = "another";
  input.repeats[2].sheet.no_go = "marks disagree";
  const Report report = judged(input, 0.01 * mm);
  ASSERT_EQ(report.repeats.size(), 6U);
  EXPECT_THAT(report.repeats[1].left_out, HasSubstr("upper face is `back`"));
  EXPECT_THAT(report.repeats[2].left_out, HasSubstr("another calibration"));
  EXPECT_THAT(report.repeats[3].left_out, HasSubstr("marks disagree"));
  EXPECT_EQ(report.repeats[4].left_out, "");
  EXPECT_EQ(report.match.rests_on, "3 repeats");
}

/// A headline 5 mm above the real sheet on a flat cloth, two branches of its ensemble at 5 and 1
/// mm, and the drape from the measured shape at 1.2 mm.
class MatchOfBranches : public testing::Test {
 protected:
  MatchOfBranches() {
    Sheet from_measured = test::mesh_sheet(2.5 * mm, 5, test::raised(1.2 * mm));
    std::get<SimulatedSource>(from_measured.source).from_measured = true;
    input_ = test::drape_of(test::measured_sheet(),
                            {test::mesh_sheet(2.5 * mm, 5, test::raised(5 * mm)), from_measured});
    list_.linked_m = 2 * mm;
    for (const int number : {1, 2}) {
      ListedBranch branch;
      branch.number = number;
      branch.sheet = fmt::format("branch-0{}/sheet.ply", number);
      branch.starts = {number - 1};
      list_.branches.push_back(branch);
    }
    input_.placed = PlacedDrape{2, 2, 1 * mm, 2 * mm, 121, {}, "at rest", 1.3 * mm, {}, {}};
    input_.scene = Scene{};
    input_.scene->friction = 0.4;
    input_.scene->stand_ins = {"friction"};
    input_.placed->other_frictions = {{0.2, "it does not come to rest: it slides", {}},
                                      {0.8, "at rest", 0.9 * mm}};
  }
  MatchVerdict verdict(double linked_m) {
    list_.linked_m = linked_m;
    const fs::path file = folder_.path() / "branches.json";
    write_record(file, list_);
    DrapeInput input = input_;
    for (const int number : {1, 2}) {
      input.simulations.push_back(
          {test::file_of(test::mesh_sheet(5 * mm, 5, test::raised((9 - 4 * number) * mm))),
           {},
           {}});
      input.simulations.back().sheet.file = folder_.path() / list_.branches[number - 1].sheet;
      fs::create_directories(input.simulations.back().sheet.file.parent_path());
      input.simulations.back().branch = test::branch(sha256_of_file(file), number, 2, 1e-3);
    }
    return judged(input, 0.01 * mm, 0, 3.5 * mm).match;
  }

  drape::test::TemporaryFolder folder_;
  DrapeInput input_;
  BranchList list_;
};

TEST_F(MatchOfBranches, IsUndecidedWhereAnotherStartIsWithinTheLimit) {
  const MatchVerdict match = verdict(2 * mm);
  EXPECT_EQ(match.match, Match::undecided) << match.reason;
  EXPECT_THAT(match.reason,
              HasSubstr("another start gives another equilibrium (branch 2), 1.000 mm away"));
  EXPECT_EQ(verdict(6 * mm).match, Match::outside)
      << "branches that cannot be told apart at this distance do not count";
}

TEST_F(MatchOfBranches, TellsTheStartFromTheModel) {
  const MatchVerdict match = verdict(2 * mm);
  ASSERT_TRUE(match.model);
  EXPECT_NEAR(match.model->distance_m / mm, 1.2, 1e-9);
  EXPECT_NEAR(match.model->least_m / mm, 0.9, 1e-9);
  EXPECT_NEAR(match.model->largest_m / mm, 1.3, 1e-9);
  EXPECT_EQ(match.model->range, "friction 0.2 to 0.8");
  EXPECT_THAT(match.model->lost, testing::ElementsAre(HasSubstr("friction 0.2: it does not come")));
  EXPECT_NEAR(*match.model->apart_m / mm, 3.8, 1e-9);
  EXPECT_TRUE(*match.model->other_branch);
  EXPECT_NEAR(*match.value_m / mm, 5, 1e-9) << "the scene's own start keeps its meaning";
  EXPECT_THAT(match.reason, HasSubstr("rests 1.200 mm away (0.900 to 1.300 mm by friction"));
  EXPECT_THAT(match.reason,
              HasSubstr("in another equilibrium (branch) than from the scene's start"));
  EXPECT_FALSE(*verdict(4 * mm).model->other_branch);
}

TEST(Match, RestsOnNothingWhereTheMeasurementIsNoGo) {
  Report report = judged(laid(8, 20 * mm), 1 * mm);
  report.no_go.emplace_back("a cause");
  const MatchVerdict verdict = match_of(laid(8, 20 * mm), {}, report);
  EXPECT_EQ(verdict.match, Match::undecided);
  EXPECT_EQ(verdict.rests_on, "");
  EXPECT_THAT(verdict.reason, HasSubstr("a cause"));
}

TEST(Match, OfAnotherSimulatorsMeshIsNeverDecidedByItsMarksAlone) {
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(23, 5, sagging(40 * mm, 0))});
  input.simulations.front().other_simulator = "Other 1.0";
  input.measured.sheet.error_budget = ErrorBudget{0.03 * mm, 0.05 * mm, 0, 0.05 * mm};
  Report report = compare_drape(input, {});
  report.budget = budget_of(budget_inputs_of(input, report, std::nullopt));
  EXPECT_LT(report.budget->expanded_m, 0.1 * mm) << "the marks and the cameras";
  for (const double tolerance_mm : {1.0, 1000.0}) {
    Options options;
    options.tolerance_m = tolerance_mm * mm;
    const MatchVerdict match = match_of(input, options, report);
    EXPECT_EQ(match.match, Match::undecided);
    EXPECT_THAT(match.reason, HasSubstr("of another simulator"));
  }
}

}  // namespace
}  // namespace drape::compare

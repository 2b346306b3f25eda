// SPDX-License-Identifier: Apache-2.0
#include "compare/tables/match.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "compare/tables/budget.hpp"
#include "compare/test_sheets.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using testing::HasSubstr;
using units::mm;

/// A cloth whose middle sags, by as much as one laying of it differs from another.
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

/// A drape that was laid `layings` times (its own too), and a simulation that sags by `sag_m`.
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

/// As compare_session() has it, with this total uncertainty.
Report judged(const DrapeInput& input, double expanded_m) {
  Options options;
  options.max_sigma_ratio = 10;  // the drawn marks are uncertain beside distances of no interest
  Report report = compare_drape(input, options);
  report.budget = Budget{};
  report.budget->expanded_m = expanded_m;
  judge_repeats(input, options, report);
  report.match = match_of(input, report);
  return report;
}

TEST(Match, OfADrapeWithRepeatsRestsOnThem) {
  const Report inside = judged(laid(8, 20 * mm), 0.01 * mm);
  EXPECT_EQ(inside.match.match, Match::inside) << inside.match.reason;
  EXPECT_EQ(inside.match.rests_on, "8 repeats");
  EXPECT_GT(inside.real_virtual[0].statistics.mean_m, 0.01 * mm) << "by U alone it is outside";
  const Report outside = judged(laid(8, 40 * mm), 0.01 * mm);
  EXPECT_EQ(outside.match.match, Match::outside) << outside.match.reason;
  EXPECT_LT(*outside.among_repeats->matches[0].p, 0.05);
  EXPECT_EQ(outside.repeats.size(), 8U);
  EXPECT_FALSE(outside.repeats[0].from_own_m);
  EXPECT_GT(*outside.repeats[1].from_own_m, 0.1 * mm);
}

TEST(Match, OutsideTheRepeatsButWithinTheUncertaintyIsUndecided) {
  const Report report = judged(laid(8, 40 * mm), 100 * mm);
  EXPECT_EQ(report.match.match, Match::undecided);
  EXPECT_THAT(report.match.reason, HasSubstr("within the total uncertainty"));
}

TEST(Match, OfOneDrapeSaysThatItRestsOnTheUncertaintyAlone) {
  const Report one = judged(laid(1, 40 * mm), 0.01 * mm);
  EXPECT_EQ(one.match.match, Match::outside);
  EXPECT_EQ(one.match.rests_on, "total uncertainty");
  EXPECT_THAT(one.match.reason, HasSubstr("of one real drape"));
  EXPECT_TRUE(one.repeats.empty());
  const Report two = judged(laid(2, 20 * mm), 100 * mm);
  EXPECT_EQ(two.match.match, Match::inside);
  EXPECT_EQ(two.match.rests_on, "total uncertainty");
  EXPECT_THAT(two.match.reason, HasSubstr("2 real drapes do not say"));
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

TEST(Match, OfADrapeOnABranchIsNotOutsideByOneStart) {
  DrapeInput input = laid(1, 40 * mm);
  input.placed = PlacedDrape{2, 2, 1 * mm, 2 * mm, {}, 0.97, {}, {}};
  const Report on = judged(input, 0.01 * mm);
  EXPECT_EQ(on.match.match, Match::undecided);
  EXPECT_EQ(on.match.rests_on, "total uncertainty, ensemble");
  EXPECT_THAT(on.match.reason, HasSubstr("on branch 2"));
  input.placed->inside_fraction = 0.5;
  EXPECT_EQ(judged(input, 0.01 * mm).match.match, Match::outside);
  input.placed->inside_fraction = 0.97;
  input.placed->branch = std::nullopt;
  EXPECT_EQ(judged(input, 0.01 * mm).match.match, Match::outside);
}

TEST(Match, RestsOnNothingWhereTheMeasurementIsNoGo) {
  Report report = judged(laid(8, 20 * mm), 1 * mm);
  report.no_go.emplace_back("a cause");
  const MatchVerdict verdict = match_of(laid(8, 20 * mm), report);
  EXPECT_EQ(verdict.match, Match::undecided);
  EXPECT_EQ(verdict.rests_on, "");
  EXPECT_THAT(verdict.reason, HasSubstr("a cause"));
}

TEST(Match, OfAnotherSimulatorsMeshIsNeverOutsideByItsMarksAlone) {
  DrapeInput input =
      test::drape_of(test::measured_sheet(), {test::simulated_sheet(23, 5, sagging(40 * mm, 0))});
  input.simulations.front().other_simulator = "Other 1.0";
  input.measured.sheet.error_budget = ErrorBudget{0.03 * mm, 0.05 * mm, 0, 0.05 * mm};
  Report report = compare_drape(input, {});
  report.budget = budget_of(budget_inputs_of(input, report, std::nullopt));
  EXPECT_LT(report.budget->expanded_m, 0.1 * mm) << "the marks and the cameras";
  const MatchVerdict match = match_of(input, report);
  EXPECT_EQ(match.match, Match::undecided);
  EXPECT_THAT(match.reason, HasSubstr("of another simulator"));
}

}  // namespace
}  // namespace drape::compare

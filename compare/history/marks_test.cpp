// SPDX-License-Identifier: Apache-2.0
#include "compare/history/results.hpp"

#include <gmock/gmock.h>

#include <random>

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;
using units::mm;

constexpr double kSd_m = 0.03 * mm;  ///< of measured_sheet()

/// The sheet with a fraction of its noise from the calibration, as stated in its budget.
Sheet with_budget(Sheet sheet, double calibration_share) {
  const double total_m = std::sqrt(3.0) * kSd_m;
  sheet.error_budget = ErrorBudget{std::sqrt(1 - calibration_share) * total_m,
                                   std::sqrt(calibration_share) * total_m, 0, total_m};
  return sheet;
}

/// The sheet with errors of a calibration, drawn per mark, and a motion of the world.
Sheet calibrated_again(Sheet sheet, double sd_m, std::mt19937& random) {
  std::normal_distribution<double> normal(0, sd_m);
  const Eigen::AngleAxisd turn(0.001, Vector3d(1, 2, 3).normalized());
  for (SheetMark& mark : sheet.marks)
    mark.point_in_world = turn * mark.point_in_world + Vector3d(0.2, -0.1, 0.3) * mm +
                          Vector3d(normal(random), normal(random), normal(random));
  return sheet;
}

std::size_t moved_in(const SheetMoves& moves) {
  std::size_t moved = 0;
  for (const MarkMove& mark : moves.marks) moved += mark.moved(moves.marks.size());
  return moved;
}

TEST(MarkMoves, StayWithinTheCovarianceOfTheDifference) {
  std::mt19937 random(3);
  constexpr double kShare = 0.25;  // so that the calibration is half of the standard deviation
  const Sheet truth = with_budget(test::measured_sheet(), kShare);
  int alarms = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Sheet first = calibrated_again(truth, std::sqrt(kShare) * kSd_m, random),
                second = calibrated_again(truth, std::sqrt(kShare) * kSd_m, random);
    alarms += moved_in(moves_between(first, second, {true, false})) > 0;
  }
  // 5 % of the sheets, plus three standard deviations of the count.
  EXPECT_LE(alarms, 0.05 * kTrials + 3 * std::sqrt(0.05 * 0.95 * kTrials));
}

TEST(MarkMoves, ShowWhatDetectionNoiseWouldHide) {
  std::mt19937 random(4);
  constexpr double kShare = 0.04;
  const Sheet truth = with_budget(test::measured_sheet(), kShare);
  Sheet second = calibrated_again(truth, std::sqrt(kShare) * kSd_m, random);
  second.marks[60].point_in_world.z() += 2.5 * kSd_m;
  const SheetMoves same = moves_between(truth, second, {true, false}),
                   other = moves_between(truth, second, {false, false});
  EXPECT_TRUE(same.marks[60].moved(same.marks.size()));
  EXPECT_EQ(moved_in(same), 1U);
  EXPECT_EQ(moved_in(other), 0U);
  EXPECT_NEAR(Eigen::AngleAxisd(same.rigid.rotation).angle(), 0.001, 2e-5);
}

TEST(MarkMoves, CountTheExcessAloneWhereTheCalibratingPicturesAreTheSame) {
  Sheet first = with_budget(test::measured_sheet(), 1), second = first;
  for (SheetMark& mark : second.marks) *mark.covariance_m2 *= 1.21;
  second.marks[60].point_in_world.z() += 3 * kSd_m;
  const double shared = moves_between(first, second, {true, true}).marks[60].chi2,
               apart = moves_between(first, second, {true, false}).marks[60].chi2;
  // Variances 1.21 - 1 and 1.21 + 1.
  EXPECT_NEAR(shared / apart, 2.21 / 0.21, 1e-3);
}

TEST(MarkMoves, NeedThreeMarks) {
  Sheet few = test::measured_sheet();
  few.marks.resize(2);
  EXPECT_THROW((void)moves_between(few, few, {}), Error);
}

using Moved = test::StoredExample;

TEST_F(Moved, MarksOfOneRunDidNotMove) {
  const Answer found = moved_marks(StoreReader(store()), 1, 1);
  EXPECT_THAT(found.sentence, HasSubstr("0 of "));
  ASSERT_EQ(found.tables[0].rows.size(), 1U);
  EXPECT_EQ(found.tables[0].rows[0][3], "0");
  EXPECT_EQ(found.tables[0].rows[0].back(), "pictures and calibration");
  EXPECT_THROW((void)moved_marks(StoreReader(store()), 1, 7), Error);
}

}  // namespace
}  // namespace drape::compare

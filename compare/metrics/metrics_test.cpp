// SPDX-License-Identifier: Apache-2.0

#include "compare/test_sheets.hpp"

namespace drape::compare {
namespace {

using test::flat;
using test::measured_sheet;
using test::simulated_sheet;
using units::deg;
using units::mm;

constexpr double kRounding_m = 1e-13;

MarkComparison compare(const Sheet& measured, const Sheet& simulated) {
  return compare_marks(measured, Surface(simulated, "simulated"));
}

test::Shape moved(const Eigen::Vector3d& offset_m) {
  return [offset_m](const Eigen::Vector2d& m) -> Eigen::Vector3d { return flat(m) + offset_m; };
}

TEST(Metrics, RigidOffsetIsTheDistanceOfEveryMark) {
  for (const int grid : {2, 11, 21, 31}) {
    const auto marks =
        compare(measured_sheet(), simulated_sheet(grid, 5, moved(Eigen::Vector3d(3, 4, 12) * mm)));
    ASSERT_EQ(marks.marks.size(), 121U) << grid;
    EXPECT_TRUE(marks.excluded.empty());
    const DistanceStatistics s = statistics_of(marks.marks);
    for (const double value : {s.mean_m, s.median_m, s.rms_m, s.p95_m, s.max_m})
      EXPECT_NEAR(value, 13 * mm, kRounding_m);
  }
}

TEST(Metrics, MarksNeedNotBeParticles) {
  // x*y is bilinear in every cell, so any grid interpolates it exactly.
  const test::Shape saddle = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return flat(m) + Eigen::Vector3d(0, 0, 3.0 * m.x() * m.y());
  };
  for (const int grid : {4, 11, 17}) {
    for (const MarkError& mark :
         compare(measured_sheet(saddle), simulated_sheet(grid, 1, saddle)).marks)
      EXPECT_NEAR(mark.distance_m, 0, kRounding_m) << grid;
  }
}

TEST(Metrics, ErrorIsSplitAlongWarpWeftAndNormal) {
  // The flat sheet: weft along +x, warp along -y, printed side up. The real cloth is shifted.
  const auto split = [](const Eigen::Vector3d& real_offset_m) {
    return compare(measured_sheet(moved(real_offset_m)), simulated_sheet(11, 1))
        .marks.front()
        .warp_weft_normal_m;
  };
  EXPECT_TRUE(split({1 * mm, 0, 0}).isApprox(Eigen::Vector3d(0, 1, 0) * mm, 1e-9));
  EXPECT_TRUE(split({0, 1 * mm, 0}).isApprox(Eigen::Vector3d(-1, 0, 0) * mm, 1e-9));
  EXPECT_TRUE(split({0, 0, 1 * mm}).isApprox(Eigen::Vector3d(0, 0, 1) * mm, 1e-9));
}

TEST(Metrics, DistancesDoNotChangeWhenBothSheetsMoveRigidly) {
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(37 * deg, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(0.4, -0.1, 0.7);
  const test::Shape bent = [](const Eigen::Vector2d& m) -> Eigen::Vector3d {
    return flat(m) + Eigen::Vector3d(0, 0.02 * std::sin(20 * m.y()), 0.05 * std::cos(15 * m.x()));
  };
  const auto turned = [&](const test::Shape& shape) -> test::Shape {
    return [=](const Eigen::Vector2d& m) -> Eigen::Vector3d { return rotation * shape(m) + shift; };
  };
  const auto before = compare(measured_sheet(bent), simulated_sheet(21, 5));
  const auto after = compare(measured_sheet(turned(bent)), simulated_sheet(21, 5, turned(flat)));
  ASSERT_EQ(before.marks.size(), after.marks.size());
  for (std::size_t i = 0; i < before.marks.size(); ++i)
    EXPECT_NEAR(before.marks[i].distance_m, after.marks[i].distance_m, 1e-12);
}

TEST(Metrics, SigmaOfADistanceIsTheCovarianceAlongIt) {
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-8, 4e-8, 9e-8).asDiagonal();
  EXPECT_NEAR(distance_sigma_m({0.01, 0, 0}, covariance), 1e-4, 1e-16);
  EXPECT_NEAR(distance_sigma_m({0, -0.02, 0}, covariance), 2e-4, 1e-16);
  EXPECT_NEAR(distance_sigma_m({1, 1, 0}, covariance), std::sqrt(2.5e-8), 1e-16);
  EXPECT_NEAR(distance_sigma_m({0, 0, 0}, covariance), 3e-4, 1e-16) << "worst direction";
  EXPECT_NEAR(worst_sigma_m(covariance), 3e-4, 1e-16);
}

TEST(Metrics, SigmaOfTheMeanFallsWithTheRootOfTheMarks) {
  const auto marks = compare(measured_sheet(), simulated_sheet(11, 5, moved({0, 0, 5 * mm})));
  const DistanceStatistics s = statistics_of(marks.marks);
  ASSERT_TRUE(s.sigma_mean_m);
  EXPECT_NEAR(*s.sigma_mean_m, 0.03 * mm / 11, 1e-15);
}

TEST(Metrics, SigmaOfTheMeanIsUnknownWhenOneMarkHasNone) {
  Sheet measured = measured_sheet();
  measured.marks[7].covariance_m2.reset();
  EXPECT_FALSE(statistics_of(compare(measured, simulated_sheet(11, 5)).marks).sigma_mean_m);
}

TEST(Metrics, StatisticsOfKnownNumbersAreExact) {
  const DistanceStatistics s = statistics_of(std::vector<double>{4, 1, 3, 2, 10});
  EXPECT_DOUBLE_EQ(s.mean_m, 4);
  EXPECT_DOUBLE_EQ(s.median_m, 3);
  EXPECT_DOUBLE_EQ(s.rms_m, std::sqrt(26.0));
  EXPECT_DOUBLE_EQ(s.p95_m, 8.8) << "0.95 * 4 = 3.8: between 4 and 10";
  EXPECT_DOUBLE_EQ(s.max_m, 10);
  EXPECT_DOUBLE_EQ(statistics_of(std::vector<double>{1, 2, 3, 4}).median_m, 2.5);
  EXPECT_DOUBLE_EQ(statistics_of(std::vector<double>{7}).p95_m, 7);
  EXPECT_THROW((void)statistics_of(std::vector<double>{}), Error);
}

TEST(Metrics, WorstMarkIsNamed) {
  Sheet measured = measured_sheet();
  measured.marks[15].point_in_world.z() = 9 * mm;
  const DistanceStatistics s = statistics_of(compare(measured, simulated_sheet(11, 5)).marks);
  EXPECT_EQ(s.worst_mark, (MarkId{1, 4}));
  EXPECT_NEAR(s.max_m, 9 * mm, kRounding_m);
}

TEST(Metrics, MarkWithoutSurfaceIsExcludedWithAReason) {
  Sheet simulated = simulated_sheet(11, 5);
  simulated.marks.erase(simulated.marks.begin() + 60);  // particle (5, 5): four cells are missing
  const auto marks = compare(measured_sheet(), simulated);
  EXPECT_EQ(marks.marks.size() + marks.excluded.size(), 121U);
  EXPECT_FALSE(marks.excluded.empty());
  for (const Excluded& excluded : marks.excluded) EXPECT_FALSE(excluded.reason.empty());
}

TEST(Surface, RefusesPointsThatFormNoGrid) {
  Sheet simulated = simulated_sheet(11, 5);
  simulated.marks[14].material_m.x() += 1 * mm;
  EXPECT_THROW(Surface(simulated, "sheet.json"), Error);
  Sheet line = simulated_sheet(11, 5);
  line.rows = 1;
  EXPECT_THROW(Surface(line, "sheet.json"), Error);
}

TEST(Surface, EdgesBelongToItAndTheOutsideDoesNot) {
  const Surface surface(simulated_sheet(11, 5), "sheet.json");
  EXPECT_TRUE(surface.at({0, 0}));
  EXPECT_TRUE(surface.at({220 * mm, 220 * mm}));
  EXPECT_FALSE(surface.at({220.1 * mm, 10 * mm}));
  EXPECT_FALSE(surface.at({10 * mm, -0.1 * mm}));
}

TEST(LatticeCoordinates, KnowsTheGaps) {
  Sheet measured = measured_sheet();
  measured.marks.erase(measured.marks.begin(), measured.marks.begin() + 30);
  const auto lattice = LatticeCoordinates::of(measured, "sheet.json");
  ASSERT_TRUE(lattice);
  EXPECT_NEAR(lattice->at({0, 3}).x(), 10 * mm, 1e-12);
  EXPECT_NEAR(lattice->at({0, 3}).y(), 70 * mm, 1e-12);
  measured.marks.resize(3);
  EXPECT_FALSE(LatticeCoordinates::of(measured, "sheet.json")) << "one row says nothing of others";
}

}  // namespace
}  // namespace drape::compare

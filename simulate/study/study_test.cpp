// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/study.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/units.hpp"
#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using units::mm;

std::filesystem::path rig() {
  return test::source_root() / "rigs/paper";
}

SimulateResult drape_paper(const std::string& name, int segments, double higher_m = 0) {
  Scene scene = read_scene(rig() / "scenes" / (name + ".toml"));
  if (higher_m != 0) scene.start.centre_in_world->z() += higher_m;
  SimulateOptions options;
  options.rows = options.cols = 11;
  options.segments = segments;
  // The turned start crosses itself during the fall; sheets that hold themselves all end on one
  // side.
  options.cloth_thickness_m = 0;
  return drape_of(scene, options);
}

Sheet mirrored(Sheet sheet, double y_m) {
  for (SheetMark& mark : sheet.marks) mark.point_in_world.y() = 2 * y_m - mark.point_in_world.y();
  return sheet;
}

bool is_mirror_image(const Sheet& one, const Sheet& two) {
  return *mean_distance_m(one, mirrored(two, 0.1), one) < 10 * mm;
}

/// The turned sheet passes through itself as it falls, so that the last bits of the numbers decide
/// where it ends: several heights of the start, until one ends on the other side.
SimulateResult drape_turned(const Sheet& flat, int segments) {
  SimulateResult turned = drape_paper("D_turned", segments);
  for (int k = 1; k < 12 && !is_mirror_image(flat, turned.sheet); ++k)
    turned = drape_paper("D_turned", segments, k * 0.1 * mm);
  return turned;
}

TEST(PaperD, TwoStartsLeadToTwoEquilibriaThatAreNearlyMirrorImages) {
  // Paper, Fig. 10 and 11: one cloth, two pins, two resting shapes.
  for (const int segments : {1, 5}) {
    const SimulateResult flat = drape_paper("D", segments);
    const SimulateResult above = drape_paper("D_above", segments);
    const SimulateResult turned = drape_turned(flat.sheet, segments);
    for (const SimulateResult* result : {&flat, &above, &turned}) {
      EXPECT_EQ(result->report.status, RestStatus::at_rest) << result->report.sentence;
    }
    EXPECT_LT(*mean_distance_m(flat.sheet, above.sheet, flat.sheet), 1 * mm);
    EXPECT_GT(*mean_distance_m(flat.sheet, turned.sheet, flat.sheet), 30 * mm);
    // The pins stand at y = 100 mm; which side the belly hangs on costs next to no energy.
    EXPECT_LT(*mean_distance_m(flat.sheet, mirrored(turned.sheet, 0.1), flat.sheet), 10 * mm);
    EXPECT_NEAR(turned.report.energy_end_j, flat.report.energy_end_j,
                0.01 * flat.report.energy_end_j);
  }
}

class Study : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::filesystem::path out_ = folder_.path();
};

TEST_F(Study, RunsOnceAndKeepsWhatIsUpToDate) {
  StudyOptions options;
  options.scenes = {"D"};
  options.grids = {5};
  options.segments = {1};
  options.threads = 2;
  const std::vector<StudyCase> cases = study_cases(rig(), out_, options);
  ASSERT_EQ(cases.size(), 2U);
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
  const std::vector<StudyOutcome> first = run_study(cases, options, program, {});
  for (const StudyOutcome& outcome : first) {
    EXPECT_FALSE(outcome.kept);
    EXPECT_TRUE(outcome.at_rest) << outcome.sentence;
  }
  const std::string csv = study_csv(first);
  EXPECT_THAT(csv, testing::HasSubstr("D,consistent,5,1,"));
  const std::string tables = study_tables(first, rig() / "published.csv");
  EXPECT_THAT(tables, testing::HasSubstr("| D | paper | - (4.6) |"));
  EXPECT_EQ(study_csv(run_study(cases, options, program, {})), csv);
}

TEST_F(Study, NamesWhatIsWrong) {
  StudyOptions options;
  options.scenes = {"Z"};
  EXPECT_THROW((void)study_cases(rig(), out_, options), Error);
  options.scenes.clear();
  options.solvers = {Solver::fall};
  EXPECT_THROW((void)study_cases(rig(), out_, options), Error);
  EXPECT_THROW((void)study_cases(out_, out_, StudyOptions{}), Error);
}

TEST(MeanDistance, IsTakenAtTheParticlesOfTheCoarsestSheet) {
  const auto flat = [](int side, double z_m) {
    Sheet sheet;
    sheet.rows = sheet.cols = side;
    sheet.patch_m = {0.2, 0.2};
    for (int k = 0; k < side * side; ++k) {
      const Eigen::Vector2d at(0.2 * (k / side) / (side - 1), 0.2 * (k % side) / (side - 1));
      sheet.marks.push_back({{k / side, k % side}, at, {at.x(), at.y(), z_m}, {}, {}, {}});
    }
    return sheet;
  };
  const Sheet plane = flat(21, 0), coarsest = flat(11, 0);
  EXPECT_NEAR(*mean_distance_m(coarsest, flat(31, 0.003), coarsest), 0.003, 1e-15);
  EXPECT_NEAR(*mean_distance_m(plane, flat(15, 0.001), coarsest), 0.001, 1e-15);
  // A tent between two marks of the coarsest grid: all of it, or only what they see of it.
  Sheet tent = plane;
  tent.marks[21 * 7 + 4].point_in_world.z() = 0.01;
  EXPECT_NEAR(*mean_distance_m(plane, tent, plane), 0.01 / 441, 1e-15);
  EXPECT_NEAR(*mean_distance_m(plane, tent, coarsest), 0, 1e-15);
  tent.marks[21 * 8 + 4].point_in_world.z() = 0.01;
  EXPECT_NEAR(*mean_distance_m(plane, tent, coarsest), 0.01 / 121, 1e-15);
  Sheet holed = coarsest;
  holed.marks.erase(holed.marks.begin());
  EXPECT_FALSE(mean_distance_m(plane, holed, coarsest).has_value());
}

}  // namespace
}  // namespace drape::simulate

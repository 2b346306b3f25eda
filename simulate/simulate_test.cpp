// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include "simulate/test_drape.hpp"

namespace drape::simulate {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using units::mm;

SimulateOptions paper_options() {
  SimulateOptions options = coarse_options();
  options.model = ClothModel::paper;
  options.paper.rows = options.paper.cols = 11;
  return options;
}

TEST(Simulate, ARestIsJudgedAndTheSameBytesEachTime) {
  const Scene scene = lying_scene("C");
  const SimulateResult result = drape_of(scene);
  const Certificate& certificate = result.certificate;
  ASSERT_TRUE(result.at_rest()) << certificate.status;
  EXPECT_LT(certificate.residual.value_or(1), certificate.residual_tolerance);
  ASSERT_TRUE(certificate.check.has_value());
  EXPECT_TRUE(certificate.check->accepted);
  EXPECT_LT(std::abs(certificate.strains->warp.y()), 0.01);
  EXPECT_EQ(std::get<SimulatedSource>(result.sheet.source).status, "at rest");
  EXPECT_EQ(farthest_m(result.sheet, drape_of(scene).sheet), 0);
}

TEST(Simulate, TooFewStepsAreNotCalledRest) {
  SimulateOptions options = coarse_options();
  options.drape.motion.longest_s = 0.05;
  options.drape.descent.most_steps = 3;
  const SimulateResult result = drape_of(lying_scene("C"), options);
  EXPECT_FALSE(result.at_rest());
  EXPECT_FALSE(result.certificate.status.empty());
  EXPECT_NE(result.certificate.status, "at rest");
  EXPECT_EQ(std::get<SimulatedSource>(result.sheet.source).status, result.certificate.status);
}

TEST(Simulate, ASheetWithANeedleThroughItIsNotCalledAtRest) {
  // Thinner than the spacing of the points where the cloth touches.
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "needle.obj";
  write_durable(file,
                "v -0.2 -0.2 0\nv 0.2 -0.2 0\nv 0.2 0.2 0\nv -0.2 0.2 0\nv 0 0 60\n"
                "f 4 3 2 1\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n");
  Scene scene = lying_scene("A");
  scene.obstacles = {MeshObject{file, {}}};
  scene.table_z_m = 0;
  scene.start = {StartMode::flat, 0, Vector3d(0.003, 0.002, 0.02), 0};
  EXPECT_FALSE(drape_of(scene).at_rest());
}

TEST(Simulate, TwoPinsHoldTheSheet) {
  const SimulateResult result = drape_of(hanging_scene());
  ASSERT_TRUE(result.at_rest()) << result.certificate.status;
  EXPECT_LT(result.certificate.distances->hold_error_m, 1e-9);
  double lowest = 1;
  for (const SheetMark& mark : result.sheet.marks)
    lowest = std::min(lowest, mark.point_in_world.z());
  EXPECT_LT(lowest, 0.3 - 0.15);
}

TEST(Simulate, ThePaperHasNoInternalFriction) {
  SimulateOptions options = paper_options();
  EXPECT_NO_THROW(options.check());
  options.internal_friction = true;
  EXPECT_THROW(options.check(), Error);
  options = {};
  options.segments = 0;
  EXPECT_THROW(options.check(), Error);
}

// The turned start folds the sheet, so that layers meet: the thickness that is stated changes where
// they end.
TEST(Simulate, TheStatedThicknessReachesThePapersModel) {
  const Scene scene = read_scene(test::source_root() / "rigs/paper/scenes/D_turned.toml");
  SimulateOptions options = paper_options();
  options.paper.max_steps = 5000;
  const SimulateResult thin = drape_of(scene, options);
  options.drape.thickness_m = 0;
  const SimulateResult none = drape_of(scene, options);
  EXPECT_GT(farthest_m(thin.sheet, none.sheet), 1 * mm);
}

/// A point of the world shifted and rotated about the vertical.
Vector3d moved(const Vector3d& p) {
  return AngleAxisd(37 * units::deg, Vector3d::UnitZ()) * p + Vector3d(0.3, -0.2, 1.0);
}
void move_pose(WorldFromObject& pose) {
  pose.rotation = AngleAxisd(37 * units::deg, Vector3d::UnitZ()) * pose.rotation;
  pose.translation_m = moved(pose.translation_m);
}
Scene moved(const Scene& scene) {
  Scene there = scene;
  for (Obstacle& obstacle : there.obstacles) {
    if (auto* sphere = std::get_if<Sphere>(&obstacle))
      sphere->centre_in_world = moved(sphere->centre_in_world);
    if (auto* box = std::get_if<Box>(&obstacle)) move_pose(box->world_from_box);
  }
  for (Pin& pin : there.pins) pin.point_in_world = moved(*pin.point_in_world);
  there.start.centre_in_world = moved(*there.start.centre_in_world);
  there.start.yaw_rad += 37 * units::deg;
  there.table_z_m += 1.0;
  return there;
}

TEST(Invariance, AMovedAndTurnedWorldHasTheSameShapesAndVerdicts) {
  const Scene hung = read_scene(test::source_root() / "rigs/paper/scenes/D.toml");
  for (const Scene& scene : {hung, lying_scene("A"), lying_scene("C")}) {
    for (const SimulateOptions& options : {coarse_options(), paper_options()}) {
      const SimulateResult here = drape_of(scene, options), there = drape_of(moved(scene), options);
      EXPECT_EQ(here.certificate.status, there.certificate.status) << scene.name;
      Sheet carried = here.sheet;
      for (SheetMark& mark : carried.marks) mark.point_in_world = moved(mark.point_in_world);
      EXPECT_LT(farthest_m(there.sheet, carried), 1e-9)
          << scene.name << " " << drape::name_of(options.model);
    }
  }
}

}  // namespace
}  // namespace drape::simulate

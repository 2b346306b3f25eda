// SPDX-License-Identifier: Apache-2.0
// A scene with its object at the position measured by a tag plate.
#include <gmock/gmock.h>

#include <cmath>

#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"
#include "triangulate/plate/plate.hpp"

namespace drape::triangulate {
namespace {

using testing::HasSubstr;
using testing::Not;
using units::mm;

constexpr const char* kScene = R"(schema = "drapebench/scene/1"
name = "C"
fabric = "../fabrics/A.toml"   # cotton
print = "../print.toml"
table_z_mm = -6.0
friction = 0.4

[start]
mode = "measured"

[[object]]
kind = "sphere"
diameter_mm = 40
x_mm = 100
y_mm = 0
z_bottom_mm = -6.0

[[object]]
kind = "box"
size_mm = [128.0, 120.0, 100.0]
x_mm = -3.0      # centre of the base
y_mm = 5.0
z_bottom_mm = -6.0
yaw_deg = 14.0
size_uncertainty_mm = 0.1
place_uncertainty_mm = 2
tags_set = "object_C"
tags_target = "../plate.toml"

[[pin]]
row = 0
col = 0
)";

std::vector<ObjectValue> seen() {
  return {{"x_mm", -2.5, 0.21, -3, 0.5},
          {"y_mm", 5.25, 0.2, 5, 0.5},
          {"z_bottom_mm", -5.9, 0.3, -6, 0.5},
          {"yaw_deg", 13.5, 0.1, 14, 0.3}};
}

TEST(MeasuredScene, HoldsThePlaceThatThePlateShowsAndAllElseAsItWas) {
  const test::TemporaryFolder folder;
  const auto scene_file = folder.path() / "rig/scenes/C.toml";
  std::filesystem::create_directories(scene_file.parent_path());
  std::filesystem::create_directories(folder.path() / "out/C");
  write_durable(scene_file, kScene);
  const auto measured_file = folder.path() / "out/C/scene_2.toml";
  write_durable(measured_file, measured_scene(scene_file, 2, seen(), measured_file.parent_path()));
  const Scene before = read_scene(scene_file), after = read_scene(measured_file);
  EXPECT_EQ(std::filesystem::weakly_canonical(after.fabric_file),
            std::filesystem::weakly_canonical(before.fabric_file));
  EXPECT_EQ(std::filesystem::weakly_canonical(after.print_file),
            std::filesystem::weakly_canonical(before.print_file));
  ASSERT_EQ(after.obstacles.size(), 2U);
  EXPECT_EQ(std::get<Sphere>(after.obstacles[0]).centre_in_world,
            std::get<Sphere>(before.obstacles[0]).centre_in_world);
  const Box& box = std::get<Box>(after.obstacles[1]);
  EXPECT_TRUE(
      box.world_from_box.translation_m.isApprox(Eigen::Vector3d(-2.5, 5.25, -5.9 + 50) * mm, 1e-9));
  EXPECT_NEAR(std::atan2(box.world_from_box.rotation(1, 0), box.world_from_box.rotation(0, 0)),
              13.5 * units::deg, 1e-9);
  EXPECT_NEAR(after.uncertainty_of(1).place_m(), 0.21 * mm, 1e-9)
      << "the larger of x and y: the bottom's has the size's besides";
  EXPECT_NEAR(after.uncertainty_of(1).size_m(), 0.1 * mm, 1e-12);
  EXPECT_EQ(after.pins.size(), 1U);
  EXPECT_THAT(read_text(measured_file), Not(HasSubstr("tags_")));
}

TEST(PlateOnObject, IsLaidOnAsWellAsItsObjectIsWide) {
  PlatePose plate;
  plate.dots = 48;
  const Obstacle box = Box{{Eigen::Matrix3d::Identity(), {0, 0, 0.05}}, {0.128, 0.12, 0.1}, 0};
  PlateOnObject lies;
  lies.placing_mm = 29;
  EXPECT_NO_THROW(static_cast<void>(object_values(plate, lies, box, {})));
  lies.placing_mm = 200;
  EXPECT_NO_THROW(check_record(lies));
  EXPECT_THROW(static_cast<void>(object_values(plate, lies, box, {})), Error);
  for (const double placing_mm : {-1.0, 0.0, std::nan(""), HUGE_VAL}) {
    lies.placing_mm = placing_mm;
    EXPECT_THROW(check_record(lies), Error) << placing_mm;
  }
  lies = {};
  lies.thickness_mm = -0.1;
  EXPECT_THROW(check_record(lies), Error);
}

TEST(PlateOnObject, LiesEdgeOnEdgeOnATopOfItsSizeOnly) {
  MarkLattice lattice;
  lattice.rows = lattice.cols = 8;
  lattice.pitch_m = 16 * mm;
  const auto box = [](double x_mm, double y_mm) -> Obstacle {
    return Box{{Eigen::Matrix3d::Identity(), {0, 0, 0.05}}, {x_mm * mm, y_mm * mm, 0.1}, 0};
  };
  const auto why = [&](const Obstacle& object) {
    return why_not_edge_on_edge(lattice, {}, object, {}).value_or("");
  };
  // Two edges aligned to 0.28 mm, and 0.5 mm of the size: three of both are 1.7 mm.
  EXPECT_EQ(why(box(128, 128)), "");
  EXPECT_EQ(why(box(126.4, 129.6)), "");
  EXPECT_THAT(why(box(126.2, 128)),
              HasSubstr("128 x 128 mm does not lie edge on edge on a top of"));
  EXPECT_THAT(why(box(100, 128)), HasSubstr("100 x 128 mm"));
  EXPECT_EQ(why(Sphere{{0, 0, 0}, 0.05}), "") << "it rests in a hole";
}

TEST(MeasuredScene, NeverReplacesASceneByHand) {
  const test::TemporaryFolder folder;
  const auto by_hand = folder.path() / "C.toml", measured = folder.path() / "C_2.toml";
  write_durable(by_hand, kScene);
  EXPECT_THROW(require_own_scene(by_hand), Error);
  EXPECT_NO_THROW(require_own_scene(measured));
  write_durable(measured, measured_scene(by_hand, 2, seen(), folder.path()));
  EXPECT_NO_THROW(require_own_scene(measured));
}

TEST(MeasuredScene, OfAnotherLayoutIsRefused) {
  const test::TemporaryFolder folder;
  const auto file = folder.path() / "C.toml";
  write_durable(file, "schema = \"drapebench/scene/1\"\nfabric = \n\"A.toml\"\n");
  EXPECT_THROW(static_cast<void>(measured_scene(file, 1, seen(), folder.path())), Error);
}

}  // namespace
}  // namespace drape::triangulate

// SPDX-License-Identifier: Apache-2.0
// Claims that no cloth fulfils, whatever the certificate allows itself.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "simulate/checker/scene.hpp"
#include "simulate/contact/piercing.hpp"
#include "tests/support/judged_drape.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using units::mm;

TEST(Certify, AToleranceThatNoRestHasIsRefused) {
  Case drape("A", ClothModel::consistent);
  drape.claim.residual_tolerance = 1e-3;
  EXPECT_TRUE(drape.judge().accepted()) << listed(drape.judge());
  drape.claim.residual_tolerance = 2e-3;
  EXPECT_FALSE(drape.judge().accepted());
  drape.claim.residual_tolerance = 1e-3;
  drape.claim.penetration_tolerance_m = 1;
  for (const CertifyLine& line : drape.judge().lines)
    if (line.what == "depth between particles (m)") {
      EXPECT_LT(line.allowed, 3 * mm) << "a tenth of the spacing of 20 mm";
    }
  drape.claim.cloth_thickness_m = 0.02;
  EXPECT_FALSE(drape.judge().accepted());
  for (double SimulateOptions::*tolerance :
       {&SimulateOptions::residual_tolerance, &SimulateOptions::static_tolerance}) {
    SimulateOptions options;
    options.*tolerance = 1e-3;
    EXPECT_NO_THROW(options.check());
    options.*tolerance = 2e-3;
    EXPECT_THROW(options.check(), Error);
  }
}

TEST(Certify, APatchOfAnotherSizeIsRefused) {
  Case drape("A", ClothModel::consistent);
  drape.print.patch_m *= 1.001;
  EXPECT_FALSE(drape.judge().accepted());
}

// Its middle never is deeper in the sheet than half its thickness, a tenth of the grid's spacing.
TEST(Certify, ARodThroughTheClothIsNoRest) {
  Case drape("D", ClothModel::consistent);
  drape.scene.obstacles = {Cylinder{{}, 1 * mm, 300 * mm, 0}};
  Sheet& sheet = drape.result.sheet;
  const auto passes = [&] {
    const CertifyReport report = drape.judge();
    const auto line = std::find_if(report.lines.begin(), report.lines.end(), [](const auto& l) {
      return l.what == "depth over the thickness of an object there";
    });
    return line != report.lines.end() && line->passes();
  };
  auto* const rod = std::get_if<Cylinder>(&drape.scene.obstacles[0]);
  // Away from the sheet, along its normal through a cell, and through one of its particles.
  rod->world_from_cylinder.translation_m = {9, 9, 9};
  EXPECT_TRUE(passes());
  const Eigen::Vector3d a = sheet.marks[60].point_in_world, b = sheet.marks[61].point_in_world,
                        c = sheet.marks[71].point_in_world;
  const Eigen::Vector3d out = (b - a).cross(c - a).normalized();
  rod->world_from_cylinder.rotation =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), out).toRotationMatrix();
  for (const Eigen::Vector3d& place :
       {Eigen::Vector3d((a + b + c) / 3), Eigen::Vector3d(0.9 * a + 0.1 * c), Eigen::Vector3d(a)}) {
    rod->world_from_cylinder.translation_m = place;
    EXPECT_FALSE(passes()) << place.transpose();
    Surroundings objects(drape.scene);
    Field position(3 * sheet.marks.size());
    for (std::size_t i = 0; i < sheet.marks.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        position[axis * sheet.marks.size() + i] =
            sheet.marks[i].point_in_world[static_cast<Eigen::Index>(axis)];
    EXPECT_NEAR(through_part({sheet.rows, sheet.cols, sheet.patch_m}, position, objects), 0.5,
                0.05);
  }
  Scene over = drape.scene;
  over.pins.clear();
  over.obstacles = {Cylinder{{}, 1 * mm, 100 * mm, 0}};
  over.table_z_m = -0.05;
  over.friction = 0.4;
  over.start = {StartMode::flat, 0, Eigen::Vector3d(0.003, 0.002, 0.053), 0};
  drape.options.solver = Solver::newton;
  drape.options.rows = drape.options.cols = 21;
  SimulateResult stands = simulate(over, drape.fabric, drape.print, std::nullopt, drape.options);
  ASSERT_EQ(stands.report.status, RestStatus::at_rest) << "flat on the table, through the rod";
  judge_rest(stands, over, drape.fabric, drape.print, drape.options);
  EXPECT_EQ(stands.report.status, RestStatus::refused);
}

TEST(Certify, PinsBeyondTheClothAreBadInput) {
  Case drape("D", ClothModel::consistent);
  const auto error = [&](const Pin& one, const Pin& other) -> std::string {
    drape.scene.pins = {one, other};
    try {
      static_cast<void>(
          simulate(drape.scene, drape.fabric, drape.print, std::nullopt, drape.options));
    } catch (const Error& e) {
      return e.what();
    }
    return {};
  };
  const Eigen::Vector3d place(-0.1, 0.1, 0.2);
  const auto beside = [&](double x) { return Eigen::Vector3d(place + Eigen::Vector3d(x, 0, 0)); };
  const double marks_m = (drape.print.material_m({0, 10}) - drape.print.material_m({0, 0})).norm();
  const Pin first{{0, 0}, place};
  EXPECT_EQ(error(first, {{0, 10}, beside(marks_m)}), "");
  EXPECT_THAT(error(first, {{0, 10}, beside(1.5 * marks_m)}), testing::HasSubstr("pins 1 and 2"));
  EXPECT_THAT(error(first, {{0, 0}, beside(0.1)}), testing::HasSubstr("pins 1 and 2"));
}

TEST(Certify, ThreadsStrainedBeyondAllMeasuredAreRefused) {
  Case drape("D", ClothModel::consistent);
  EXPECT_TRUE(drape.judge().accepted()) << listed(drape.judge());
  const double most = 2 * drape.fabric.tensile[0].x.back();
  for (SheetMark& mark : drape.result.sheet.marks) mark.point_in_world *= 1.1 + most;
  const CertifyReport report = drape.judge();
  EXPECT_TRUE(std::any_of(report.lines.begin(), report.lines.end(), [](const CertifyLine& line) {
    return !line.passes() && line.what == "warp strain over the last measured";
  })) << listed(report);
}

/// A long roof whose ridge lies along x at z = 0; mm.
constexpr const char* kRoof =
    "v -50 0 0\nv 50 0 0\nv 50 50 -1.5\nv -50 50 -1.5\nv 50 -50 -1.5\nv -50 -50 -1.5\n"
    "v 50 50 -40\nv -50 50 -40\nv 50 -50 -40\nv -50 -50 -40\n"
    "f 1 2 3 4\nf 2 1 6 5\nf 4 3 7 8\nf 5 6 10 9\nf 8 7 9 10\nf 2 5 9 7 3\nf 1 4 8 10 6\n";

// Below a ridge the nearest face, and so the normal, depends on the last bits of the place.
TEST(StatedForces, AtARidgeAreWithinTheConeOfEitherFace) {
  constexpr double kFriction = 0.25, kLength_m = 1e-9;
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "roof.obj", kRoof);
  Scene scene;
  scene.obstacles = {MeshObject{folder.path() / "roof.obj", {}}};
  scene.friction = kFriction;
  const checker::Objects objects(scene);
  const double slope = std::atan2(1.5, 50);
  const Eigen::Vector3d normal(0, std::sin(slope), std::cos(slope));
  const Eigen::Vector3d down(0, std::cos(slope), -std::sin(slope));
  const auto kept = [&](double y_m, const Eigen::Vector3d& force_n) {
    const auto found = checker::pushed_by(objects, 0, {0, y_m, -40e-6L}, kFriction, 0, force_n);
    return Eigen::Vector3d(double((*found)[0]), double((*found)[1]), double((*found)[2]));
  };
  const Eigen::Vector3d most = normal + kFriction * down;
  for (const double y_m : {-1e-8, 0.0, 1e-8}) {
    EXPECT_LT((kept(y_m, most) - most).norm(), kLength_m) << y_m;
    // Farther down no face carries it: the nearest cone's part is left.
    EXPECT_LT((kept(y_m, normal + 2 * kFriction * down) - most).norm(), kLength_m) << y_m;
  }
  EXPECT_GT((kept(-1e-3, most) - most).norm(), 0.01) << "the other face";
}

}  // namespace
}  // namespace drape::simulate

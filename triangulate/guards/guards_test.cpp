// SPDX-License-Identifier: Apache-2.0
#include "triangulate/guards/guards.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/geometry/body.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"
#include "triangulate/guards/held.hpp"
#include "triangulate/guards/objects.hpp"

namespace drape::triangulate {
namespace {

namespace fs = std::filesystem;

using Eigen::Vector3d;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;

constexpr double kPitch_m = 20 * mm;
constexpr double kSigma_m = 0.02 * mm;

/// 11 x 11 marks on a cylinder of this radius about y, spaced by `factor` times the pitch along the
/// cloth, with its top at z = 0.
Sheet bent_sheet(double radius_m, double factor) {
  Sheet sheet;
  sheet.rows = sheet.cols = 11;
  sheet.patch_m = {220 * mm, 220 * mm};
  for (int row = 0; row < 11; ++row) {
    for (int col = 0; col < 11; ++col) {
      const double along_m = factor * kPitch_m * (col - 5),
                   across_m = factor * kPitch_m * (5 - row);
      SheetMark mark;
      mark.mark = {row, col};
      mark.material_m = {kPitch_m * (row + 0.5), kPitch_m * (col + 0.5)};
      mark.point_in_world = {radius_m * std::sin(along_m / radius_m), across_m,
                             radius_m * (std::cos(along_m / radius_m) - 1)};
      mark.covariance_m2 = kSigma_m * kSigma_m * Eigen::Matrix3d::Identity();
      sheet.marks.push_back(mark);
    }
  }
  return sheet;
}

std::vector<std::string> pitch_of(const Sheet& sheet) {
  return contradictions_of_pitch(sheet.marks, kPitch_m, 1e-3, 1e-4, "print.toml");
}

std::vector<std::string> objects_of(const Sheet& sheet, const Scene& scene) {
  return contradictions_of_objects({sheet, spans_of(sheet, 1e-3)}, scene);
}

TEST(Guards, MarksOfAnotherPrintThanTheScenesAreRefused) {
  Scene scene;
  scene.print_file = test::source_root() / "rigs/bench1/print.toml";
  MarkLattice detected;
  detected.rows = detected.cols = 11;
  detected.pitch_m = kPitch_m;
  detected.dot_diameter_m = 4 * mm;
  detected.patch_m = {220 * mm, 220 * mm};
  detected.margin_m = {10 * mm, 10 * mm};
  EXPECT_NO_THROW(require_detected_print(detected, scene));
  for (double* value : {&detected.pitch_m, &detected.dot_diameter_m, &detected.patch_m.x(),
                        &detected.margin_m.y()}) {
    *value += 1e-3 * mm;
    EXPECT_THROW(require_detected_print(detected, scene), Error);
    *value -= 1e-3 * mm;
  }
  detected.rows = 12;
  EXPECT_THROW(require_detected_print(detected, scene), Error);
}

TEST(Guards, BentClothOfTheRightPitchGivesNoAlarm) {
  for (const double radius_mm : {60.0, 100.0, 1000.0})
    EXPECT_THAT(pitch_of(bent_sheet(radius_mm * mm, 1)), IsEmpty()) << radius_mm;
}

TEST(Guards, APitchThatIsHalfAPerCentOffIsNamedWithTheRightOne) {
  for (const double radius_mm : {60.0, 1000.0}) {
    const auto longer = pitch_of(bent_sheet(radius_mm * mm, 1.005));
    ASSERT_EQ(longer.size(), 2U) << "warp and weft " << radius_mm;
    EXPECT_THAT(longer[0], HasSubstr("print.toml: pitch_mm = 20"));
    EXPECT_THAT(longer[0], HasSubstr("speak for 20.10 mm"));
    const auto shorter = pitch_of(bent_sheet(radius_mm * mm, 0.995));
    ASSERT_EQ(shorter.size(), 2U);
    EXPECT_THAT(shorter[1], HasSubstr("speak for 19.90 mm"));
  }
}

/// 11 x 11 marks spaced by `factor` times the pitch along cloth that is in sine folds across a
/// direction of the print.
Sheet folded_sheet(double slope_deg, double wavelength_mm, double direction_deg, double phase,
                   double factor) {
  Sheet sheet = bent_sheet(1, 1);
  const double per_m = 2 * std::numbers::pi / (wavelength_mm * mm);
  const double slope = std::tan(slope_deg * units::deg);
  const auto speed = [&](double x) { return std::hypot(1, slope * std::cos(per_m * x + phase)); };
  const auto x_at = [&](double arc_m) {  // inverts the arc length by Simpson's rule and Newton
    double x = arc_m;
    for (int k = 0; k < 6; ++k) {
      constexpr int kParts = 60;
      double sum = speed(0) + speed(x);
      for (int i = 1; i < kParts; ++i) sum += (i % 2 == 1 ? 4 : 2) * speed(x * i / kParts);
      x -= (x * sum / (3 * kParts) - arc_m) / speed(x);
    }
    return x;
  };
  const double turn = direction_deg * units::deg;
  const Eigen::Vector2d along(std::cos(turn), std::sin(turn)), across(-along.y(), along.x());
  for (SheetMark& mark : sheet.marks) {
    const Eigen::Vector2d flat =
        factor * kPitch_m * Eigen::Vector2d(mark.mark.col - 5, 5 - mark.mark.row);
    const double x = x_at(along.dot(flat));
    mark.point_in_world.head<2>() = x * along + across.dot(flat) * across;
    mark.point_in_world.z() = slope / per_m * std::sin(per_m * x + phase);
    mark.covariance_m2 = std::pow(kSigma_m / 4, 2) * Eigen::Matrix3d::Identity();
  }
  return sheet;
}

TEST(Guards, FoldedClothOfTheRightPitchGivesNoAlarm) {
  for (const double slope_deg : {10, 20, 30, 45, 55})
    for (const double wavelength_mm : {60, 80, 100, 140, 200})
      for (const double direction_deg : {0, 20, 45})
        for (const double phase : {0.0, 1.0})
          EXPECT_THAT(pitch_of(folded_sheet(slope_deg, wavelength_mm, direction_deg, phase, 1)),
                      IsEmpty())
              << slope_deg << " degrees, " << wavelength_mm << " mm towards " << direction_deg;
}

TEST(Guards, TheStatedErrorsOfScaleHoldTheTrueOneAndZeroOnlyWhereNothingIsNamed) {
  for (const double wavelength_mm : {100, 200}) {
    for (const double error : {-3e-3, -2e-3, -5e-4, 0.0, 5e-4, 2e-3, 3e-3}) {
      const Sheet sheet = folded_sheet(30, wavelength_mm, 20, 0, 1 + error);
      const UnseenScale unseen = unseen_scale(sheet.marks, kPitch_m, 1e-3, 1e-4);
      ASSERT_TRUE(unseen.least && unseen.most);
      EXPECT_LE(*unseen.least, error);
      EXPECT_GE(*unseen.most, error);
      EXPECT_LT(*unseen.most - *unseen.least, 3e-3);
      EXPECT_EQ(pitch_of(sheet).empty(), *unseen.least <= 0 && *unseen.most >= 0) << error;
      EXPECT_TRUE(std::abs(error) < 2e-3 || !pitch_of(sheet).empty()) << error;
    }
  }
  EXPECT_THAT(scale_text({-1e-3, std::nullopt}), HasSubstr("wrong by -0.10 % to any amount"));
}

/// A scene with the cloth on a box of 100 mm whose top is at z = 0.
Scene box_scene(const Vector3d& shift_m) {
  Scene scene;
  scene.file = "C.toml";
  scene.table_z_m = -100 * mm;
  Box box;
  box.size_m = Vector3d::Constant(100 * mm);
  box.world_from_box.translation_m = Vector3d(0, 0, -50 * mm) + shift_m;
  scene.obstacles = {box};
  return scene;
}

TEST(Guards, ClothThatLiesOnItsObjectGivesNoAlarm) {
  EXPECT_THAT(objects_of(bent_sheet(1, 1), box_scene({0, 0, -5.5 * mm})), testing::Not(IsEmpty()))
      << "nearest mark 5.5 mm above";
  EXPECT_THAT(objects_of(bent_sheet(1, 1), box_scene({0, 0, -2.0 * mm})), IsEmpty());
}

/// Cloth that is flat up to the edge at x = 50 mm and hangs from there, straight and steep; marks
/// at x = 45 and then 15 mm of arc beyond the edge.
Sheet hanging_sheet(double slope_deg) {
  Sheet sheet = bent_sheet(1, 1);
  const double slope = slope_deg * units::deg;
  for (SheetMark& mark : sheet.marks) {
    const double along_m = kPitch_m * (mark.mark.col - 5) + 5 * mm;
    const double beyond_m = std::max(0.0, along_m - 50 * mm);
    mark.point_in_world.x() = std::min(along_m, 50 * mm) + beyond_m * std::cos(slope);
    mark.point_in_world.z() = -beyond_m * std::sin(slope);
  }
  return sheet;
}

TEST(Guards, ABoxBesideItsPlaceLeavesTheClothTooShort) {
  const Sheet sheet = hanging_sheet(60);
  EXPECT_THAT(objects_of(sheet, box_scene({0, 0, 0})), IsEmpty());
  EXPECT_THAT(objects_of(sheet, box_scene({1 * mm, 0, 0})), IsEmpty()) << "2 standard deviations";
  const auto found = objects_of(sheet, box_scene({6 * mm, 0, 0}));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], HasSubstr("too short to pass outside it"));
  // The cloth hangs free on the other side, so a box moved that way cannot be noticed.
  EXPECT_THAT(objects_of(sheet, box_scene({-6 * mm, 0, 0})), IsEmpty());
}

TEST(Guards, WhatTheMarksCannotSeeOfAnObjectIsStated) {
  const Sheet sheet = hanging_sheet(60);
  const Scene scene = box_scene({0, 0, 0});
  const auto limits = detection_limits({sheet, spans_of(sheet, 1e-3)}, scene);
  ASSERT_EQ(limits.size(), 1U);
  EXPECT_EQ(limits[0].of, "object 1");
  EXPECT_THAT(limits[0].limits,
              HasSubstr("no error of its place towards -x up to 50 mm would be seen"));
  // Held on both sides, across a narrower box: the guard reports from the stated limit on.
  Sheet held = sheet;
  for (SheetMark& mark : held.marks) {
    const double along_m = kPitch_m * (mark.mark.col - 5);
    const double beyond_m = std::max(0.0, std::abs(along_m) - 45 * mm);
    mark.point_in_world.x() =
        std::copysign(std::min(std::abs(along_m), 45 * mm) + 0.5 * beyond_m, along_m);
    mark.point_in_world.z() = -std::sqrt(0.75) * beyond_m;
  }
  Scene narrow = box_scene({0, 0, 0});
  std::get<Box>(narrow.obstacles[0]).size_m.x() = 90 * mm;
  EXPECT_THAT(objects_of(held, narrow), IsEmpty());
  const std::string text = detection_limits({held, spans_of(held, 1e-3)}, narrow)[0].limits;
  EXPECT_THAT(text, HasSubstr("towards +y up to")) << "nothing holds it along y";
  EXPECT_THAT(text, HasSubstr("drape object"));
}

/// A ball as high as a box of 160 mm leaves level cloth unsupported, but not cloth with creases.
TEST(Guards, ABallForABoxIsSeenByLevelClothAlone) {
  constexpr const char* kBall = "a ball as high in its place would not be seen";
  Scene scene = box_scene({0, 0, -30 * mm});
  scene.table_z_m = -160 * mm;
  std::get<Box>(scene.obstacles[0]).size_m = Vector3d::Constant(160 * mm);
  Sheet top = bent_sheet(1000, 1);
  std::erase_if(top.marks, [](const SheetMark& mark) {
    return mark.point_in_world.head<2>().cwiseAbs().maxCoeff() > 81 * mm;
  });
  ASSERT_EQ(top.marks.size(), 81U);
  const auto text = [&] { return detection_limits({top, spans_of(top, 1e-3)}, scene)[0].limits; };
  EXPECT_THAT(text(), testing::Not(HasSubstr(kBall)));
  for (SheetMark& mark : top.marks)
    if (mark.mark.col % 2 == 1) mark.point_in_world.z() += 1 * mm;
  EXPECT_THAT(text(), HasSubstr(kBall));
  EXPECT_THAT(text(), HasSubstr("a cylinder as high in its place would not be seen"));
  Cylinder round{{}, 80 * mm, 160 * mm, 0};
  round.world_from_cylinder = std::get<Box>(scene.obstacles[0]).world_from_box;
  scene.obstacles[0] = round;
  EXPECT_THAT(text(), HasSubstr("error of its diameter"));
  EXPECT_THAT(text(), HasSubstr("a cube as high in its place would not be seen"));
}

TEST(Guards, ATautStringOverABoxHasTheLengthOfItsTwoStraightParts) {
  Box box;
  box.size_m = Vector3d::Constant(100 * mm);
  const auto path_mm = [&](const Vector3d& from, const Vector3d& to) {
    return taut_path_m(box, from * mm, to * mm) / mm;
  };
  EXPECT_NEAR(path_mm({40, 0, 50}, {50, 0, 40}), 20, 1e-9);
  EXPECT_NEAR(path_mm({42, 0, 50}, {62, 0, 34}), 28, 1e-9);
  // Obliquely over the edge; unrolled it is 28 mm across and 3 mm along.
  EXPECT_NEAR(path_mm({42, 0, 50}, {62, 3, 34}), std::hypot(28, 3), 1e-9);
  EXPECT_NEAR(path_mm({0, 0, 51}, {20, 0, 51}), 20, 1e-9) << "free";
  EXPECT_NEAR(path_mm({-1, 60, 40}, {-1, 40, 60}), std::sqrt(800), 1e-9) << "touches the edge";
  EXPECT_LT(path_mm({42, 49, 50}, {62, 49, 34}), 26) << "no statement at a corner";
  box.edge_radius_m = 2 * mm;
  EXPECT_NEAR(path_mm({40, 0, 50}, {50, 0, 40}), 16 + std::numbers::pi, 1e-9);
  const Sphere ball{{0, 0, 0}, 45 * mm};
  EXPECT_NEAR(taut_path_m(ball, {45 * mm, 0, 0}, {0, 45 * mm, 0}) / mm, 22.5 * std::numbers::pi,
              1e-9);
}

TEST(Guards, MarksInsideTheObjectNameItAndTheHeightThatFits) {
  const auto found = objects_of(bent_sheet(1, 1), box_scene({0, 0, 6 * mm}));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], HasSubstr("C.toml, object 1"));
  EXPECT_THAT(found[0], HasSubstr("inside it"));
  EXPECT_THAT(found[0], HasSubstr("z_bottom_mm = -10"));
  // Flat cloth does not determine a position.
  EXPECT_THAT(found[0], testing::Not(HasSubstr("the marks speak for")));
}

TEST(Guards, ATopIsTooHighBeyondItsOwnStandardDeviations) {
  // Position and size uncertain by 0.5 mm each: 0.71 mm, exceeded by 2.58 times in one of 200.
  const Sheet sheet = bent_sheet(1000, 1);
  EXPECT_THAT(objects_of(sheet, box_scene({0, 0, 1.7 * mm})), IsEmpty());
  const auto found = objects_of(sheet, box_scene({0, 0, 2.2 * mm}));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], HasSubstr("its top lower by at most 1.82 mm"));
  // The printed limits are those of the guard: too low by the thickest cloth and three deviations.
  EXPECT_THAT(detection_limits({sheet, spans_of(sheet, 1e-3)}, box_scene({0, 0, 0}))[0].limits,
              HasSubstr("an error of its top's height below 3.1 mm (too low) would not be seen"));
}

TEST(Guards, ObjectsWithinTheirStatedUncertaintiesGiveNoAlarm) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal(0, 0.5 * mm);
  const Sheet sheet = hanging_sheet(60);
  int alarms = 0;
  for (int draw = 0; draw < 200; ++draw) {
    Scene scene = box_scene({normal(random), normal(random), normal(random)});
    Box& box = std::get<Box>(scene.obstacles[0]);
    const double larger_m = normal(random);
    box.size_m += Vector3d::Constant(larger_m);
    box.world_from_box.translation_m.z() += 0.5 * larger_m;
    alarms += !objects_of(sheet, scene).empty();
  }
  EXPECT_LE(alarms, 6) << "one in 100 is allowed; seven of 200 come once in 200 then";
}

TEST(Guards, AStatedUncertaintyMovesTheLimit) {
  Scene scene = box_scene({0, 0, 3 * mm});
  EXPECT_EQ(objects_of(bent_sheet(1, 1), scene).size(), 1U);
  scene.uncertainties = {{2 * mm, 0.1 * mm, {}, false}};
  EXPECT_THAT(objects_of(bent_sheet(1, 1), scene), IsEmpty());
}

TEST(Guards, APinOfAMarkThatIsAGapIsNamedWithItsReason) {
  Sheet sheet = bent_sheet(1, 1);
  sheet.marks.erase(sheet.marks.begin());
  sheet.gaps.push_back({{0, 0}, "seen by one camera (cam1)"});
  Scene scene;
  scene.pins = {{{0, 0}, std::nullopt}, {{0, 10}, std::nullopt}};
  MarkLattice lattice;
  lattice.rows = lattice.cols = 11;
  lattice.pitch_m = kPitch_m;
  const auto found = contradictions_of_held(sheet, scene, lattice);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], HasSubstr("(0, 0), which was not measured (seen by one camera (cam1))"));
  EXPECT_THAT(found[0], HasSubstr("at_material_mm"));
}

/// Writes a box of this width as triangles, standing on the origin, in mm.
fs::path box_file(const drape::test::TemporaryFolder& folder, double side_mm) {
  std::string text;
  for (int i = 0; i < 8; ++i)
    text += fmt::format("v {} {} {}\n", (i & 1) != 0 ? side_mm / 2 : -side_mm / 2,
                        (i & 2) != 0 ? side_mm / 2 : -side_mm / 2, (i & 4) != 0 ? side_mm : 0);
  text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  fs::path file = folder.path() / fmt::format("box_{}.obj", side_mm);
  write_durable(file, text);
  return file;
}

TEST(Guards, AMeshThatIsNotUnderTheClothIsNamed) {
  const drape::test::TemporaryFolder folder;
  const Sheet sheet = bent_sheet(1, 1);  // its top at z = 0
  const auto of = [&](double side_mm, double top_mm) {
    Scene scene;
    scene.file = "scene.toml";
    scene.table_z_m = -1;
    MeshObject object{box_file(folder, side_mm), {}};
    object.world_from_mesh.translation_m = {0, 0, (top_mm - side_mm) * mm};
    scene.obstacles = {object};
    SeenCloth seen{sheet, {}, {gaps_to_mesh(sheet, object, 2)}};
    return std::pair(contradictions_of_objects(seen, scene), detection_limits(seen, scene));
  };
  // 3.855 sqrt(0.5^2 + 0.5^2) mm and three deviations of a mark are 3.03 mm.
  EXPECT_THAT(of(60, -0.9).first, IsEmpty());
  EXPECT_THAT(of(60, 2.6).first, IsEmpty());
  EXPECT_THAT(of(60, 3.3).first, testing::ElementsAre(HasSubstr("deep inside")));
  EXPECT_THAT(of(60, -4).first, testing::ElementsAre(HasSubstr("no mark touches it")));
  EXPECT_THROW(of(0.06, -60), Error) << "a mesh in metres is refused";
  EXPECT_THAT(of(60, 0).second.at(0).limits, HasSubstr("deeper inside than 3.0 mm"));
}

TEST(Guards, GapsToABoxOfTrianglesAreThoseToTheBox) {
  const drape::test::TemporaryFolder folder;
  MeshObject object{box_file(folder, 60), {}};
  object.world_from_mesh.rotation = Eigen::AngleAxisd(0.4, Vector3d::UnitZ()).toRotationMatrix();
  object.world_from_mesh.translation_m = {5 * mm, -7 * mm, 11 * mm};
  Box box{object.world_from_mesh, Vector3d::Constant(60 * mm), 0};
  box.world_from_box.translation_m.z() += 30 * mm;
  std::mt19937_64 random(20261126);
  std::uniform_real_distribution<double> place(-80 * mm, 80 * mm);
  Sheet sheet = bent_sheet(1, 1);
  for (int times = 0; times < 4; ++times)
    sheet.marks.insert(sheet.marks.end(), sheet.marks.begin(), sheet.marks.begin() + 121);
  for (SheetMark& mark : sheet.marks)
    mark.point_in_world = {place(random), place(random), place(random)};
  const std::vector<double> gaps = gaps_to_mesh(sheet, object, 1);
  for (std::size_t i = 0; i < gaps.size(); ++i)
    ASSERT_NEAR(gaps[i], distance_to(box, sheet.marks[i].point_in_world), 1e-12) << i;
}

TEST(Guards, DistancesToBodiesAreThoseOfGeometry) {
  EXPECT_NEAR(distance_to(Sphere{{0, 0, 1}, 0.5}, {0, 0, 2}), 0.5, 1e-12);
  Box box;
  box.size_m = {2, 2, 2};
  box.edge_radius_m = 0.1;
  EXPECT_NEAR(distance_to(box, {0, 0, 1.5}), 0.5, 1e-12);
  EXPECT_NEAR(distance_to(box, {0, 0, 0.75}), -0.25, 1e-12);
  EXPECT_NEAR(distance_to(box, {2, 2, 2}), std::sqrt(3) * 1.1 - 0.1, 1e-12);
  EXPECT_FALSE(distance_to(MeshObject{}, {0, 0, 0}));
}

}  // namespace
}  // namespace drape::triangulate

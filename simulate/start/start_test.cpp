// SPDX-License-Identifier: Apache-2.0
// Starts: the flat pose, the measured shape, pins, clamps, variations, histories, and invalid ones.
#include "simulate/start/start.hpp"

#include <gmock/gmock.h>

#include "core/files/files.hpp"
#include "simulate/start/history.hpp"
#include "tests/support/bench1_truth.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;
using units::deg;
using units::mm;

std::filesystem::path bench() {
  return test::source_root() / "rigs/bench1";
}

/// The error that a call throws, with its field; empty if none.
std::string fault_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const Error& error) {
    return std::string(error.what()) + " | " + error.where().field + " | " + error.what_to_do();
  }
  return "";
}

/// The sheet that triangulation would give without error: the dots seen well by two cameras.
Sheet true_sheet(const std::string& drape, const Print& print) {
  Sheet sheet;
  sheet.rows = print.rows;
  sheet.cols = print.cols;
  sheet.patch_m = print.patch_m;
  for (const test::TrueDot& dot : test::bench1_truth().drapes.at(drape)) {
    if (dot.facing_views(60) < 2) continue;
    sheet.marks.push_back({dot.mark, print.material_m(dot.mark), dot.point_in_world, {}, {}, {}});
  }
  sheet.source = MeasuredSource{};
  return sheet;
}

Scene bench_scene(const std::string& drape) {
  return read_scene(bench() / "scenes" / (drape + ".toml"));
}

TEST(Start, FlatPoseIsFoundFromTheMarksOnTop) {
  const Print print = read_print(bench() / "print.toml");
  const FlatPose truth{{0.01, -0.02, 0.1}, 17 * deg};
  Sheet sheet;
  sheet.rows = sheet.cols = 11;
  sheet.patch_m = print.patch_m;
  for (int r = 0; r < 11; ++r) {
    for (int c = 0; c < 11; ++c) {
      Vector3d p = truth.point_in_world(print.material_m({r, c}), print.patch_m);
      // The border hangs down and inwards and must not count.
      if (r < 3 || r > 7 || c < 3 || c > 7) p += Vector3d(0.005, 0.004, -0.04);
      sheet.marks.push_back({{r, c}, print.material_m({r, c}), p, {}, {}, {}});
    }
  }
  StartReport report;
  const FlatPose found = fit_flat(sheet, 0.1, report);
  EXPECT_NEAR(found.yaw_rad, truth.yaw_rad, 1e-9);
  EXPECT_LT((found.centre_in_world - truth.centre_in_world).norm(), 1e-9);
  EXPECT_EQ(report.marks_used, 25);
}

TEST(Start, PrintedSideIsUp) {
  // Seen from above with row 0 at the top, col 0 is at the left: weft x (-warp) points up.
  const FlatPose pose{Vector3d::Zero(), 0.3};
  const Vector2d patch(0.2, 0.2);
  const Vector3d origin = pose.point_in_world({0.1, 0.1}, patch);
  const Vector3d warp = pose.point_in_world({0.15, 0.1}, patch) - origin;
  const Vector3d weft = pose.point_in_world({0.1, 0.15}, patch) - origin;
  EXPECT_NEAR(weft.x() * -warp.y() - weft.y() * -warp.x(), 0.0025, 1e-12);
}

TEST(Start, Bench1SheetsAreTurnedAsTheirDotsAre) {
  // Every true cloth started near these yaws and rotated by a few degrees while falling.
  const Print print = read_print(bench() / "print.toml");
  const std::pair<const char*, double> drapes[] = {{"A", 9.0}, {"C", 15.5}, {"E", -6.0}};
  for (const auto& [name, yaw_deg] : drapes) {
    StartReport report;
    const FlatPose pose =
        fit_flat(true_sheet(name, print), Surroundings(bench_scene(name)).top_z_m(), report);
    EXPECT_NEAR(pose.yaw_rad / deg, yaw_deg, 3) << name;
    EXPECT_LT(report.placement_rms_mm, 2) << name;
  }
}

TEST(Start, MarksOfAnotherClothOrOfOneSeenFromBehindPlaceNothing) {
  const Print print = read_print(bench() / "print.toml");
  for (const std::string name : {"A", "C", "E"}) {
    const Scene scene = bench_scene(name);
    const double top_z_m = Surroundings(scene).top_z_m();
    const Sheet right = true_sheet(name, print);
    EXPECT_NO_THROW((void)local_scene(scene, right, top_z_m)) << name;
    const auto fault = [&](const auto& change) {
      Sheet sheet = right;
      for (SheetMark& mark : sheet.marks) change(mark);
      return fault_of([&] { (void)local_scene(scene, sheet, top_z_m); });
    };
    for (const std::string& found :
         {fault([](SheetMark& m) { std::swap(m.material_m.x(), m.material_m.y()); }),
          fault([&](SheetMark& m) { m.material_m.x() = print.patch_m.x() - m.material_m.x(); }),
          fault([](SheetMark& m) { m.point_in_world.x() *= -1; })})
      EXPECT_THAT(found, HasSubstr("its mirror image misses it by")) << name;
    // Heights are not scaled, otherwise the sheet would be above its object.
    for (const double scale : {0.8, 1.2})
      EXPECT_THAT(fault([&](SheetMark& m) { m.point_in_world.head<2>() *= scale; }),
                  HasSubstr("its unit right?"))
          << name << scale;
  }
}

/// Pins at 92 % of the marks' own distance: the cloth sags between them by more than its top marks
/// have come down.
TEST(Start, MarksOfAClothThatSagsBetweenPinsPlaceIt) {
  const Print print = read_print(bench() / "print.toml");
  Scene scene = bench_scene("C");
  scene.obstacles.clear();
  scene.uncertainties.clear();
  const FlatPose truth{{0, 0, 0.08}, 17 * deg};
  Sheet sheet;
  sheet.rows = sheet.cols = 11;
  sheet.patch_m = print.patch_m;
  sheet.source = MeasuredSource{};
  for (int r = 0; r < 11; ++r)
    for (int c = 0; c < 11; ++c) {
      Vector3d p = truth.point_in_world(print.material_m({r, c}), print.patch_m);
      p.head<2>() *= 0.92;
      p.z() -= 0.5 * 35 * mm * (2 - std::pow(0.2 * r - 1, 2) - std::pow(0.2 * c - 1, 2));
      sheet.marks.push_back({{r, c}, print.material_m({r, c}), p, {}, {}, {}});
    }
  const auto fault = [&] { return fault_of([&] { (void)local_scene(scene, sheet, 0.08); }); };
  EXPECT_THAT(fault(), HasSubstr("miss the flat cloth")) << "no pin holds it";
  for (const MarkId mark : {MarkId{0, 0}, MarkId{0, 10}, MarkId{10, 0}, MarkId{10, 10}}) {
    Pin pin;
    pin.mark = mark;
    pin.point_in_world = sheet.find(mark)->point_in_world;
    scene.pins.push_back(pin);
  }
  EXPECT_EQ(fault(), "");
  for (SheetMark& mark : sheet.marks) mark.point_in_world.x() *= -1;
  EXPECT_THAT(fault(), HasSubstr("its mirror image misses it by"));
}

// E lacks 44 of its 121 marks: below the cube's edges no two cameras see them well.
TEST(MeasuredShape, KeepsTheMarksAndFillsTheOthersOutsideObjects) {
  const Print print = read_print(bench() / "print.toml");
  for (const std::string name : {"A", "C", "E"}) {
    const Scene scene = bench_scene(name);
    const Sheet sheet = true_sheet(name, print);
    const Surroundings around(scene);
    const MaterialShape shape = measured_shape(scene, sheet, print, around);
    EXPECT_NEAR(shape.filled, 1 - static_cast<double>(sheet.marks.size()) / 121, 1e-12) << name;
    EXPECT_THAT(shape.warnings, testing::Contains(HasSubstr("were not measured"))) << name;
    Vector2d low = shape.material_m.front(), high = low;
    for (const Vector2d& at : shape.material_m) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    EXPECT_LE(low.maxCoeff(), 0) << name;
    EXPECT_GE((high - print.patch_m).minCoeff(), -1e-9) << name;
    for (const Vector3d& place : shape.places)
      for (int k = 0; k < around.count(); ++k) EXPECT_GT(around.gap_m(k, place), -1e-6) << name;
    for (const SheetMark& mark : sheet.marks) {
      double nearest_m = 1;
      for (std::size_t k = 0; k < shape.places.size(); ++k)
        if ((shape.material_m[k] - mark.material_m).norm() < 1e-9)
          nearest_m = (shape.places[k] - mark.point_in_world).norm();
      // Measured marks can be inside the object by the noise of their positions: 0.1 mm.
      EXPECT_LT(nearest_m, 0.1 * mm) << name;
    }
  }
}

/// A surface bent about the weft, without a fifth of its marks in one patch.
TEST(MeasuredShape, ContinuesABentSurfaceAcrossAGap) {
  const Print print = read_print(bench() / "print.toml");
  const auto place = [](const Vector2d& at) {
    constexpr double kRadius = 0.1;
    return Vector3d(at.y(), -kRadius * std::sin(at.x() / kRadius),
                    1 + kRadius * std::cos(at.x() / kRadius));
  };
  Sheet sheet = true_sheet("A", print);
  sheet.marks.clear();
  for (int r = 0; r < print.rows; ++r)
    for (int c = 0; c < print.cols; ++c)
      if (std::abs(r - 5) > 2 || std::abs(c - 5) > 2)
        sheet.marks.push_back(
            {{r, c}, print.material_m({r, c}), place(print.material_m({r, c})), {}, {}, {}});
  Scene scene = bench_scene("A");
  scene.obstacles.clear();
  const MaterialShape shape = measured_shape(scene, sheet, print, Surroundings(scene));
  double farthest_m = 0;
  for (std::size_t k = 0; k < shape.places.size(); ++k)
    farthest_m = std::max(farthest_m, (shape.places[k] - place(shape.material_m[k])).norm());
  // The gap's sides are 120 mm long: a flat filling would differ from the arc by 20 mm.
  EXPECT_LT(farthest_m, 2 * mm);
  sheet.marks.resize(2);
  EXPECT_THAT(fault_of([&] { (void)measured_shape(scene, sheet, print, Surroundings(scene)); }),
              HasSubstr("do not span a surface"));
  EXPECT_THAT(fault_of([&] { (void)measured_shape(scene, {}, print, Surroundings(scene)); }),
              HasSubstr("--start-from"));
}

TEST(Pins, WithoutAPlaceNeedTheMeasuredSheet) {
  Scene scene = bench_scene("A");
  const Print print = read_print(scene.print_file);
  scene.pins = {{{0, 0}, std::nullopt}};
  EXPECT_THAT(fault_of([&] { (void)pin_places(scene, print, std::nullopt); }),
              HasSubstr("pin.at_mm"));
  const Sheet sheet = true_sheet("A", print);
  scene.pins = {{sheet.marks.front().mark, std::nullopt}};
  EXPECT_LT((pin_places(scene, print, sheet).front() - sheet.marks.front().point_in_world).norm(),
            1e-12);
  scene.pins = {{{11, 0}, Vector3d(0, 0, 0)}};
  EXPECT_THAT(fault_of([&] { (void)pin_places(scene, print, std::nullopt); }),
              HasSubstr("rows 0 to 10"));
}

/// A square of 200 mm.
ClothOutline square() {
  return {{{0, 0}, {0.2, 0}, {0.2, 0.2}, {0, 0.2}}, {}, {}, {}};
}

TEST(StartCheck, RefusesPinsBesideTheCloth) {
  Scene scene = bench_scene("A");
  const Print print = read_print(scene.print_file);
  ClothOutline outline = square();
  outline.holes = {circle({0.1, 0.1}, 0.02, 16)};
  const auto fault = [&](const Vector2d& at) {
    scene.pins = {{{}, Vector3d(0, 0, 0), at}};
    return fault_of([&] { refuse_pins_beside(scene, print, outline); });
  };
  EXPECT_EQ(fault({0, 0.2}), "") << "on a corner";
  EXPECT_THAT(fault({0.1, 0.1}), HasSubstr("not on the cloth")) << "in the hole";
  EXPECT_THAT(fault({0.1, 0.201}), HasSubstr("warp 100, weft 201 mm"));
}

TEST(StartCheck, RefusesAFlatStartThatCouldComeOutBelowAnObject) {
  Scene scene = bench_scene("A");
  Print print = read_print(scene.print_file);
  print.patch_m = {0.2, 0.2};
  scene.start.mode = StartMode::flat;
  scene.obstacles = {Sphere{Vector3d(0, 0, 0.05), 0.05}};
  scene.table_z_m = 0;
  ClothOutline outline = square();
  const auto fault = [&](const Vector3d& centre) {
    scene.start.centre_in_world = centre;
    return fault_of([&] { refuse_flat_start_inside(scene, print, outline, Surroundings(scene)); });
  };
  for (const double z_m : {0.0999, 0.1, 0.2})  // placed on it, touching, above
    EXPECT_EQ(fault({0, 0, z_m}), "") << z_m;
  EXPECT_THAT(fault({0, 0, 0.1e-3}), HasSubstr("start.centre_mm | its height must be some"));
  EXPECT_THAT(fault({0, 0, 0.06}), HasSubstr("some 40 mm more"));
  scene.obstacles.clear();
  EXPECT_THAT(fault({0, 0, -0.02}), HasSubstr("some 20 mm more")) << "below the table";
  // A post next to a round specimen, where a square one has its corner.
  scene.obstacles = {
      Box{{Eigen::Matrix3d::Identity(), Vector3d(0.09, 0.09, 0.05)}, Vector3d(0.01, 0.01, 0.1), 0}};
  EXPECT_THAT(fault({0, 0, 0.05}), HasSubstr("some 50 mm more"));
  outline.outer = circle({0.1, 0.1}, 0.1, 64);
  EXPECT_EQ(fault({0, 0, 0.05}), "");
}

TEST(StartCheck, RefusesAPatchOfNoClothsSize) {
  const Scene scene = bench_scene("A");
  for (const double side : {1e12, 100.1, 0.9e-4, 0.0, -1.0, std::nan("")}) {
    for (const int axis : {0, 1}) {
      Print print = read_print(scene.print_file);
      EXPECT_NO_THROW(require_sized(print, scene));
      print.patch_m[axis] = side;
      EXPECT_THAT(fault_of([&] { require_sized(print, scene); }), HasSubstr("patch_mm")) << side;
    }
  }
}

// A sphere with its diameter in metres, gravity in g, and a sphere away from the falling cloth.
TEST(Scenes, OfOtherUnitsAreRefusedOrDoubted) {
  const test::TemporaryFolder folder;
  std::string text = read_text(bench() / "scenes/A.toml");
  const auto at = text.find("diameter_mm");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, text.find('\n', at) - at, "diameter_mm = 0.09");
  write_durable(folder.path() / "A.toml", text);
  EXPECT_THROW((void)read_scene(folder.path() / "A.toml"), Error);
  Scene scene = bench_scene("A");
  EXPECT_NO_THROW(require_gravity_of_earth(scene));
  EXPECT_TRUE(warnings_of_scene(scene, 0.001, 0.01).empty());
  EXPECT_EQ(warnings_of_scene(scene, 0.3, 0.01).size(), 1U) << "it touches nothing";
  scene.gravity_m_per_s2 = {0, 0, -0.98};
  EXPECT_THROW(require_gravity_of_earth(scene), Error);
  EXPECT_EQ(warnings_of_scene(scene, {}, 0.01).size(), 1U);
}

TEST(Clamps, AreLinesThatLeaveInTheirDirection) {
  Scene scene = bench_scene("A");
  const Print print = read_print(scene.print_file);
  // Along the weft at both hems and inside, and along the warp; stretched by one per cent.
  scene.clamps = {{{0, 0}, {0, 0.2}, {0, 0, 1}, {0.202, 0, 1}, {0.5, -1, 0}},
                  {{0.1, 0.05}, {0.1, 0.15}, {0, 0, 1}, {0.1, 0, 1}, {0, -1, 0}},
                  {{0.2, 0}, {0.2, 0.2}, {0, -1, 1}, {0.2, -1, 1}, {0, 1, 0}},
                  {{0.03, 0}, {0.07, 0}, {0, 0, 2}, {0, -0.04, 2}, {1, 0, 0}}};
  const std::vector<HeldLine> lines = held_lines(scene, print, square());
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_LT((lines[0].x_u - Vector3d(0, -1, 0)).norm(), 1e-12) << "across the clamp";
  EXPECT_LT((lines[0].x_v - Vector3d(1.01, 0, 0)).norm(), 1e-12);
  EXPECT_LT((lines[0].place({0, 0.1}) - Vector3d(0.101, 0, 1)).norm(), 1e-12);
  EXPECT_LT((lines[1].x_u - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((lines[2].x_u - Vector3d(0, -1, 0)).norm(), 1e-12) << "the cloth lies before it";
  EXPECT_LT((lines[3].x_v - Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_TRUE(lines[1].holds({0.1, 0.15}));
  EXPECT_FALSE(lines[1].holds({0.1, 0.151}));
  EXPECT_FALSE(lines[1].holds({0.101, 0.1}));
  EXPECT_THAT(warnings_of_clamps(lines), testing::IsEmpty());
}

TEST(Clamps, ThatCannotHoldAreNamed) {
  const Scene scene = bench_scene("A");
  const Print print = read_print(scene.print_file);
  const auto fault = [&](const std::function<void(Scene&)>& change) {
    Scene held = scene;
    held.clamps = {{{0, 0}, {0, 0.2}, {0, 0, 1}, {0.2, 0, 1}, {0, -1, 0}}};
    change(held);
    return fault_of([&] { (void)held_lines(held, print, square()); });
  };
  const auto changed = [&](const std::function<void(Clamp&)>& change) {
    return fault([&](Scene& held) { change(held.clamps[0]); });
  };
  EXPECT_EQ(changed([](Clamp&) {}), "");
  EXPECT_THAT(changed([](Clamp& c) {
                c.to_material_m = {0.1, 0.2};
              }),
              HasSubstr("clamp 1 crosses the threads"));
  EXPECT_THAT(changed([](Clamp& c) { c.to_material_m = {0, 0.3}; }), HasSubstr("leaves the cloth"));
  EXPECT_THAT(changed([](Clamp& c) { c.to_material_m = {0, 0}; }), HasSubstr("has no length"));
  EXPECT_THAT(changed([](Clamp& c) { c.to_in_world = c.from_in_world; }),
              HasSubstr("has no length"));
  EXPECT_THAT(changed([](Clamp& c) {
                c.direction_in_world = {1, 0, 0};
              }),
              HasSubstr("left along itself"));
  const Clamp along{{0, 0}, {0.1, 0}, {0, 0, 1}, {0, -0.1, 1}, {1, 0, 0}};
  EXPECT_EQ(fault([&](Scene& held) { held.clamps.push_back(along); }), "");
  EXPECT_THAT(fault([&](Scene& held) {
                held.clamps.push_back(along);
                held.clamps[1].from_in_world.z() += 1e-3;
              }),
              HasSubstr("clamp 2 and clamp 1 hold the same point of the cloth 1 mm apart"));
  EXPECT_THAT(fault([&](Scene& held) {
                held.pins = {{{}, Vector3d(0.1, 0.002, 1), Vector2d(0, 0.1)}};
              }),
              HasSubstr("and a pin hold the same point of the cloth 2 mm apart"));
}

TEST(Clamps, ThatKinkTheClothAreDoubted) {
  Scene scene = bench_scene("A");
  scene.clamps = {{{0, 0}, {0, 0.2}, {0, 0, 1}, {0.2, 0, 1}, {0, -1, -1}},
                  {{0, 0}, {0.1, 0}, {0, 0, 1}, {0, -0.1, 1}, {1, 0, 0}}};
  EXPECT_THAT(
      warnings_of_clamps(held_lines(scene, read_print(scene.print_file), square())),
      testing::ElementsAre(HasSubstr("clamps 1 and 2 meet on the cloth and turn it 45 deg")));
}

TEST(Variation, OfTheFirstStartIsNoneAndOthersAreSeeded) {
  std::vector<Vector3d> flat, moved, again;
  for (int i = 0; i < 100; ++i) flat.emplace_back(0.02 * (i % 10), 0.02 * int{i / 10}, 0.3);
  moved = flat;
  vary(variation_of(0), moved);
  for (std::size_t k = 0; k < flat.size(); ++k) EXPECT_LT((moved[k] - flat[k]).norm(), 1e-12);
  for (int start = 1; start < 50; ++start) {
    const StartVariation v = variation_of(start);
    EXPECT_LE(v.place_m.cwiseAbs().maxCoeff(), 2 * mm);
    EXPECT_NEAR(v.friction_factor, 1, 0.1);
    EXPECT_LE(std::abs(std::log2(v.drag_factor)), 2);
    EXPECT_LE(std::abs(std::log2(variation_of(start, false).friction_factor)), 1);
    moved = again = flat;
    vary(v, moved);
    vary(v, again);
    double farthest_m = 0;
    for (std::size_t k = 0; k < flat.size(); ++k) {
      EXPECT_GE(moved[k].z(), flat[k].z()) << "lowered";
      EXPECT_EQ(moved[k], again[k]);
      farthest_m = std::max(farthest_m, (moved[k] - flat[k]).norm());
    }
    EXPECT_GT(farthest_m, 0.1 * mm);
    EXPECT_LT(farthest_m, 60 * mm);
  }
}

TEST(History, IsReadAndItsFaultsAreNamed) {
  Scene scene = bench_scene("A");
  for (const char* text : {"",
                           "folded",
                           "bent",
                           "bent 1.5",
                           "bent 1.5 per mm along warp",
                           "bent x per cm along warp",
                           "bent nan per cm along warp",
                           "bent 0 per cm along warp",
                           "bent 21 per cm along warp",
                           "bent 1e999 per cm along weft",
                           "bent 1.5 per cm along bias",
                           "draped",
                           "draped 0 times",
                           "draped -1 times",
                           "draped 1.5 times",
                           "draped 51 times",
                           "draped 1e9 times",
                           "shaken 3 times by 0 %",
                           "shaken 3 times by 96 %",
                           "shaken 3 times by -5 %",
                           "shaken 3 times by 40",
                           "flat flat",
                           "Flat"}) {
    scene.start.history = {"flat", text};
    const std::string fault = fault_of([&] { (void)history_of(scene); });
    EXPECT_THAT(fault, HasSubstr("| start.history |")) << text;
    EXPECT_THAT(fault, HasSubstr(text));
  }
  scene.start.history = {"shaken 3 times", "flat"};
  EXPECT_THAT(fault_of([&] { (void)history_of(scene); }), HasSubstr("so nothing follows"));
  scene.start.history = {"flat", "bent -1.5 per cm along weft", "draped 2 times",
                         "shaken 5 times by 40 %"};
  const std::vector<PastEvent> events = history_of(scene);
  ASSERT_EQ(events.size(), 4U);
  EXPECT_DOUBLE_EQ(events[1].curvature_per_m, -150);
  EXPECT_EQ(events[1].direction, 1);
  EXPECT_EQ(shakes_of(events).times, 5);
  EXPECT_DOUBLE_EQ(shakes_of(events).part, 0.4);
}

/// Elements keep the force that bending beyond their limits left, "flat" resets it, and a drape
/// that does not rest ends the history.
TEST(History, LeavesItsMemory) {
  ClothFriction friction;
  friction.bending[0] = FrictionStack{{{1e-4, 1e-4, 0}}};
  ClothMemory fresh;
  fresh.bending[0] = {0, 0};
  const auto after = [&](std::vector<std::string> texts, const DrapeOnce& drape) {
    Scene scene = bench_scene("A");
    scene.start.history = std::move(texts);
    return memory_after(history_of(scene), friction, fresh, drape);
  };
  const DrapeOnce none = [](const ClothMemory&) { return std::nullopt; };
  const auto bent = after({"bent 1 per cm along warp"}, none);
  ASSERT_TRUE(bent.has_value());
  // An element slips at 1 per m: bent to 100 it slips by 99, and on return to flat by 98 of them.
  for (const double slip : bent->bending[0]) EXPECT_NEAR(slip, 1, 1e-9);
  const auto forgotten = after({"bent 1 per cm along warp", "flat"}, none);
  ASSERT_TRUE(forgotten.has_value());
  EXPECT_EQ(forgotten->bending[0], fresh.bending[0]);
  EXPECT_FALSE(after({"draped 1 times"}, none).has_value());
  int drapes = 0;
  const DrapeOnce counts = [&](const ClothMemory& memory) {
    ++drapes;
    return std::optional<ClothMemory>(memory);
  };
  EXPECT_TRUE(after({"draped 3 times", "shaken 2 times"}, counts).has_value());
  EXPECT_EQ(drapes, 3);
}

}  // namespace
}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
// Compares drapes with converged rests of another discretisation: tests/data/converged-drapes.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>

#include "core/files/files.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/drape/outline.hpp"
#include "simulate/drape/smooth_surface.hpp"
#include "simulate/drape/test_drape.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

struct Found {
  bool at_rest = false;
  double distance_m = 0, stated_m = 0;  ///< means
};

/// `pins`: held points instead of the scene's.
Found found_of(const std::string& name, const DrapeOptions& options,
               const std::vector<Pin>& pins = {}) {
  Scene scene = read_scene(test::test_data("independent-drapes") / (name + ".toml"));
  if (!pins.empty()) scene.pins = pins;
  const Print print = read_print(scene.print_file);
  const DrapeCase drape =
      drape_case(scene, print, std::nullopt, fit_laws(read_fabric(scene.fabric_file), 1).laws);
  const Drape rest = drape_cloth(drape, options);
  const Csv converged = read_csv(test::test_data("converged-drapes") / (name + ".csv"),
                                 {"warp_mm", "weft_mm", "x_mm", "y_mm", "z_mm"});
  const auto& columns = converged.columns;
  std::vector<Vector2d> material;
  for (std::size_t k = 0; k < columns[0].size(); ++k)
    material.emplace_back(columns[0][k] * mm, columns[1][k] * mm);
  const Eigen::MatrixX3d places = rest.level->places(rest.rest, material);
  Found found{rest.at_rest(), 0, rest.mesh_error_m.mean()};
  for (std::size_t k = 0; k < material.size(); ++k) {
    const Vector3d there(columns[2][k], columns[3][k], columns[4][k]);
    const Vector3d here = places.row(static_cast<Eigen::Index>(k));
    found.distance_m +=
        (drape.local.to_world(here) - mm * there).norm() / static_cast<double>(material.size());
  }
  return found;
}

TEST(ConvergedDrapes, LieWithinTheStatedMeshErrorOfCoarseLevels) {
  DrapeOptions options;
  options.spacing_m = 5 * mm;
  for (const char* name : {"hang", "sphere", "cube"}) {
    const Found found = found_of(name, options);
    EXPECT_TRUE(found.at_rest) << name;
    EXPECT_LE(found.distance_m, found.stated_m) << name;
  }
}

// The converged rest is held every 1.667 mm; points 2.5 mm apart approximate that.
TEST(ConvergedDrapes, AreMetOnTheBiasWhereItIsHeldAsAnArea) {
  std::vector<Pin> pins;
  for (int i = 0; i <= 80; ++i)
    for (int k = 0; k <= 80 && i + k <= 120; ++k)
      pins.push_back(
          {{}, Vector3d(2.5 * k - 100, 100 - 2.5 * i, 200) * mm, Vector2d(2.5 * i, 2.5 * k) * mm});
  const Found found = found_of("bias", {}, pins);
  EXPECT_TRUE(found.at_rest);
  EXPECT_LE(found.distance_m, 0.08 * mm);
}

/// A cubic map, in units of its size.
MeshCloth::Jet cubic(const Vector2d& p) {
  const double u = p.x(), v = p.y();
  return {{u + 3 * u * v * v, v - 2 * u * u * u + u * v, 0.1 + 4 * u * u - 5 * v * v * v},
          {1 + 3 * v * v, -6 * u * u + v, 8 * u},
          {6 * u * v, 1 + u, -15 * v * v}};
}

MeshCloth::Jet quadratic(const Vector2d& p) {
  const double u = p.x(), v = p.y();
  return {{u + u * v, v - u * u, 2 * u * u - v * v}, {1 + v, -2 * u, 4 * u}, {u, 1, -2 * v}};
}

void expect_same(const MeshCloth::Jet& found, const MeshCloth::Jet& expected, double error) {
  EXPECT_LT((found.x - expected.x).norm(), error);
  EXPECT_LT((found.x_u - expected.x_u).norm(), 100 * error);
  EXPECT_LT((found.x_v - expected.x_v).norm(), 100 * error);
}

SmoothSurface scattered(int count, MeshCloth::Jet (*map)(const Vector2d&)) {
  SplitMix64 random(7);
  std::vector<Vector2d> material;
  std::vector<Vector3d> places;
  for (int i = 0; i < count; ++i) {
    material.emplace_back(0.2 * random.uniform(), 0.1 * random.uniform());
    places.push_back(map(material.back()).x);
  }
  return {material, places};
}

TEST(SmoothSurface, ReproducesACubicAlsoBeyondItsPoints) {
  const SmoothSurface surface = scattered(400, cubic);
  for (const Vector2d& p : {Vector2d(0.1, 0.05), Vector2d(0.003, 0.09), Vector2d(0.21, 0.11)})
    expect_same(surface.at(p), cubic(p), 1e-12);
}

TEST(SmoothSurface, ReproducesAQuadraticThroughAsFewPointsAsDetermineIt) {
  expect_same(scattered(8, quadratic).at({0.05, 0.05}), quadratic({0.05, 0.05}), 1e-11);
}

TEST(SmoothSurface, RefusesPointsOnALine) {
  const SmoothSurface line({{0, 0}, {0.1, 0}, {0.2, 0}, {0.3, 0}},
                           {{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}, {0.3, 0, 0}});
  EXPECT_THROW(static_cast<void>(line.at({0.1, 0})), Error);
}

TEST(DrapeLevel, CarriesAQuadraticShapeExactly) {
  const DrapeCase drape = case_of(ball(0));
  const DrapeLevel coarse(drape, {}, 10 * mm), fine(drape, {}, 5 * mm);
  ClothMoment moment;
  moment.state = coarse.cloth().state_of(quadratic);
  const ClothMoment carried = fine.carried(coarse, moment);
  const MeshCloth::State expected = fine.cloth().state_of(quadratic);
  for (std::size_t i = 0; i < expected.size(); ++i)
    ASSERT_LT((carried.state[i] - expected[i]).norm(), 1e-11);
}

TEST(DrapeLevel, StatesPlacesOnItsSurface) {
  const DrapeCase drape = case_of(ball(0));
  const DrapeLevel level(drape, {}, 10 * mm);
  ClothMoment moment;
  moment.state = level.cloth().state_of(quadratic);
  const Eigen::MatrixX3d places = level.places(moment, {{0, 0}, {0.037, 0.061}, {0.13, 0}});
  EXPECT_LT((places.row(0).transpose() - quadratic({0, 0}).x).norm(), 1e-12);
  EXPECT_LT((places.row(1).transpose() - quadratic({0.037, 0.061}).x).norm(), 1e-12);
  EXPECT_TRUE(places.row(2).hasNaN());
}

TEST(DrapeLevel, HoldsAClampWithItsSlope) {
  Scene scene = ball(0);
  scene.obstacles.clear();
  scene.start.centre_in_world = Vector3d(0, 0, 0);
  const Vector3d direction = Vector3d(0, -1, -0.5).normalized();
  scene.clamps.push_back({{0.03, 0}, {0.03, 0.12}, {-0.06, 0.03, 0}, {0.06, 0.03, 0}, direction});
  const DrapeCase drape = case_of(scene);
  DrapeLevel level(drape, {}, 10 * mm);
  ClothMoment moment = level.start();
  ASSERT_TRUE(level.fall(moment).at_rest);
  const MaterialMesh& mesh = level.cloth().mesh();
  int sides = 0;
  for (std::size_t e = 0; e < mesh.edges.size(); ++e) {
    const Vector2d &a = mesh.points_m[mesh.edges[e].from], &b = mesh.points_m[mesh.edges[e].to];
    if (std::abs(a.x() - 0.03) > 1e-9 || std::abs(b.x() - 0.03) > 1e-9) continue;
    ++sides;
    const double sign = level.cloth().normal_of(static_cast<int>(e)).x();
    const Vector3d& slope = moment.state[level.cloth().points() + e];
    EXPECT_LT((sign * slope - direction).norm(), 1e-9);
    const Vector3d& place = moment.state[mesh.edges[e].from];
    EXPECT_LT((place - Vector3d(a.y() - 0.06, 0.03, 0)).norm(), 1e-9);
  }
  EXPECT_GE(sides, 12);
}

/// Without friction, so everything that no pin holds slides off.
Scene pinned_ball() {
  Scene scene = ball(0);
  scene.start.centre_in_world->z() = 0;
  const double angle = 1.0 / 6;  // 5 mm along the sphere
  scene.pins = {{{}, Vector3d(0, 0, 0), Vector2d(60 * mm, 60 * mm)},
                {{},
                 30 * mm * Vector3d(std::sin(angle), 0, std::cos(angle) - 1),
                 Vector2d(60 * mm, 65 * mm)}};
  return scene;
}

Scene hung() {
  Scene scene = ball(0);
  scene.obstacles.clear();
  scene.pins = {{{}, Vector3d(-50 * mm, 60 * mm, 0), Vector2d(0, 0)},
                {{}, Vector3d(50 * mm, 60 * mm, 0), Vector2d(0, 120 * mm)}};
  scene.table_z_m = -1;
  return scene;
}

/// Relative difference between first-order responses to a change of gravity and new rests under a
/// fraction `part` of that change, in both directions.
double error_of_first_order(const Scene& scene, double part) {
  const DrapeCase drape = case_of(scene);
  DrapeOptions options;
  options.spacing_m = options.coarsest_m = 10 * mm;
  options.descent.residual = 1e-8;
  const Drape rest = drape_cloth(drape, options);
  EXPECT_TRUE(rest.at_rest());
  DrapeLevel& level = *rest.level;
  const int points = level.cloth().points();
  const Vector3d change(0.3, 0.2, -1);
  MeshCloth::State forces(level.cloth().unknowns(), Vector3d::Zero());
  for (int i = 0; i < points; ++i) forces[i] = level.cloth().mass_kg()[i] * change;
  const auto found = level.first_order(rest.rest, {forces});
  if (!found) return 1;
  ClothMoment moments[2] = {rest.rest, rest.rest};
  for (int k = 0; k < 2; ++k) {
    level.set_gravity(scene.gravity_m_per_s2 + (k == 0 ? part : -part) * change);
    EXPECT_TRUE(level.rest(moments[k]).at_rest);
  }
  double wrong = 0, all = 0;
  for (int i = 0; i < points; ++i) {
    const Vector3d moved = (moments[0].state[i] - moments[1].state[i]) / (2 * part);
    wrong += (moved - found->front()[i]).squaredNorm();
    all += moved.squaredNorm();
  }
  return std::sqrt(wrong / all);
}

TEST(DrapeLevel, AnswersASmallChangeOfForcesToFirstOrder) {
  // A hundredth, as required by sensitivities: a finite step adds and removes contact points.
  EXPECT_LT(error_of_first_order(pinned_ball(), 3e-3), 1e-2);
  EXPECT_LT(error_of_first_order(hung(), 3e-2), 1e-4);
}

/// An irregular cloth with a corner cut off and a hole beside its centre.
ClothOutline odd_cloth() {
  return {{{0, 0}, {0.12, 0}, {0.12, 0.08}, {0.08, 0.12}, {0, 0.12}},
          {circle({0.035, 0.035}, 0.012, 8)},
          {}};
}

TEST(DrapeLevel, RefusesAnOutlineInCentimetresAndAPinInAHole) {
  ClothOutline small = odd_cloth();
  small.holes.clear();
  for (Vector2d& corner : small.outer) corner /= 10;
  const DrapeCase drape = case_of(ball(0), small);
  try {
    const DrapeLevel level(drape, {}, 10 * mm);
    FAIL() << "a cloth of a few spacings was meshed";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("not cm"));
  }
  Scene scene = ball(0);
  scene.pins = {{{}, Vector3d(0, 0, 0), Vector2d(0.035, 0.035)}};
  EXPECT_THROW(static_cast<void>(case_of(scene, odd_cloth())), Error);
}

TEST(Levels, HoldPinsExactlyWhateverTheirDistance) {
  Scene scene = hung();
  scene.pins.push_back({{}, Vector3d(-49 * mm, 60 * mm, 0), Vector2d(0, 1 * mm)});
  DrapeOptions options;
  options.spacing_m = 5 * mm;
  const DrapeCase drape = case_of(scene, odd_cloth());
  const Drape rest = drape_cloth(drape, options);
  ASSERT_TRUE(rest.at_rest());
  const MaterialMesh& mesh = rest.level->cloth().mesh();
  ASSERT_EQ(rest.level->pinned().size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(mesh.points_m[rest.level->pinned()[k]], *scene.pins[k].at_material_m);
    EXPECT_EQ(rest.rest.state[rest.level->pinned()[k]], rest.level->pinned_at()[k]);
  }
  // Neither the corner beyond the cut nor the hole is cloth.
  EXPECT_LT(rest.marks.size(), 36U);
  double lowest = 0;
  for (const Vector3d& place : rest.level->surface(rest.rest)) lowest = std::min(lowest, place.z());
  EXPECT_LT(lowest, 20 * mm - 120 * mm * std::sqrt(0.5));
}

TEST(Levels, AreHalvedFromTheCoarsest) {
  DrapeOptions options;
  EXPECT_THAT(level_spacings_m(options), testing::ElementsAre(10 * mm, 5 * mm, 2.5 * mm));
  options.spacing_m = 10 * mm;
  EXPECT_THAT(level_spacings_m(options), testing::ElementsAre(10 * mm));
  options.spacing_m = 3 * mm;
  EXPECT_THAT(level_spacings_m(options), testing::ElementsAre(10 * mm, 6 * mm, 3 * mm));
}

// Without friction: with it the rest depends on the fall, which is on the coarsest mesh.
TEST(Levels, RestWhereAFallOnTheFinestMeshDoes) {
  const DrapeCase drape = case_of(hung());
  DrapeOptions options;
  options.spacing_m = 5 * mm;
  const Drape levels = drape_cloth(drape, options);
  options.coarsest_m = options.spacing_m;
  const Drape fall = drape_cloth(drape, options);
  options.seed = 2;
  const Drape other = drape_cloth(drape, options);
  ASSERT_TRUE(levels.at_rest() && fall.at_rest() && other.at_rest());
  EXPECT_LT(mean_distance_m(levels.marks_of_level.back(), fall.marks_of_level.back()),
            mean_distance_m(fall.marks_of_level.back(), other.marks_of_level.back()));
}

TEST(Levels, GoOnFromARestOnACoarserMesh) {
  const DrapeCase drape = case_of(ball(0.3));
  DrapeOptions options;
  options.spacing_m = options.coarsest_m = 10 * mm;
  const Drape coarse = drape_cloth(drape, options);
  options.spacing_m = 5 * mm;
  const Drape all = drape_cloth(drape, options);
  const Drape on = polished(drape, options, coarse.level, coarse.rest);
  ASSERT_TRUE(on.at_rest());
  EXPECT_LT(mean_distance_m(on.marks_of_level.back(), all.marks_of_level.back()), 0.02 * mm);
  EXPECT_EQ(on.mesh_error_m.size(), std::ssize(on.marks));
}

/// The mesh error stated for a mark whose error is spacing^order m, and the true one.
struct StatedError {
  double stated_m, true_m;

  StatedError(const DrapeCase& drape, const std::vector<double>& spacings_m, double order,
              bool jumped = false)
      : stated_m(0), true_m(std::pow(spacings_m.back(), order)) {
    std::vector<LevelReport> levels;
    std::vector<Eigen::MatrixX3d> marks;
    for (const double spacing : spacings_m) {
      levels.push_back({spacing, 0, {}, {}});
      marks.emplace_back(Eigen::RowVector3d(0, 0, std::pow(spacing, order)));
      if (marks.size() > 1) levels.back().moved_m = (marks.back() - marks[marks.size() - 2]).norm();
    }
    stated_m = mesh_error_m(drape, levels, marks, jumped)(0);
  }
};

TEST(MeshError, HasASmallSafetyFactorOnlyWhereTheOrderIsSeenToBeTheMethods) {
  DrapeCase pinned, clamped;
  pinned.pins_at = {Vector3d::Zero()};
  clamped.lines.resize(1);
  const double h = 2.5e-3;
  // The last are those of a finest mesh of 3 mm, whose first step is not a half.
  for (const std::vector<double>& spacings :
       {std::vector<double>{4 * h, 2 * h, h}, {8 * h, 4 * h, 2 * h, h}, {10e-3, 6e-3, 3e-3}}) {
    for (const double order : {1.0, 1.5, 1.75, 1.85, 2.0, 2.15, 2.25, 3.0}) {
      const StatedError free({}, spacings, order);
      EXPECT_GE(free.stated_m, free.true_m) << order;
      for (const DrapeCase* held : {&pinned, &clamped})
        EXPECT_GE(StatedError(*held, spacings, order).stated_m, 2.4 * free.true_m) << order;
    }
  }
  const std::vector<double> halves = {4 * h, 2 * h, h};
  const double moved = 3 * h * h;
  EXPECT_NEAR(StatedError({}, halves, 2).stated_m, 1.25 * moved / 3, 1e-12);
  EXPECT_NEAR(StatedError(clamped, halves, 2).stated_m, 3 * moved / 3, 1e-12);
  EXPECT_NEAR(StatedError(pinned, halves, 2).stated_m, 3 * moved, 1e-12);
  for (const double order : {1.75, 2.25}) {
    const StatedError other({}, halves, order);
    EXPECT_GE(other.stated_m, 2.4 * other.true_m) << order;
  }
  EXPECT_NEAR(StatedError({}, {2 * h, h}, 2).stated_m, 3 * moved / 3, 1e-12);
  EXPECT_NEAR(StatedError({}, halves, 2, true).stated_m, 3 * moved, 1e-12)
      << "on the branch of the finest mesh no order is seen";
}

TEST(Levels, GiveTheSameBytesAndDoNotSeeWhereTheWorldIs) {
  DrapeOptions options;
  options.spacing_m = 5 * mm;
  const Scene scene = ball(0.3);
  const DrapeCase here = case_of(scene);
  const Drape first = drape_cloth(here, options);
  EXPECT_EQ(first.rest.state, drape_cloth(here, options).rest.state);
  Scene moved = scene;
  const Vector3d shift(1.25, -0.75, 0.5);
  moved.table_z_m += shift.z();
  std::get<Sphere>(moved.obstacles[0]).centre_in_world += shift;
  *moved.start.centre_in_world += shift;
  moved.start.yaw_rad = 0.5;
  const DrapeCase there = case_of(moved);
  const Drape second = drape_cloth(there, options);
  EXPECT_LT(mean_distance_m(first.marks_of_level.back(), second.marks_of_level.back()), 1e-6);
  const Vector3d mark = second.marks_of_level.back().row(0);
  const Vector3d turned = Eigen::AngleAxisd(0.5, Vector3d::UnitZ()) *
                              here.local.to_world(first.marks_of_level.back().row(0)) +
                          shift;
  EXPECT_LT((there.local.to_world(mark) - turned).norm(), 10e-6);
}

using testing::HasSubstr;

constexpr double kSpacing_m = 2 * mm;

class Outlines : public testing::Test {
 protected:
  ClothOutline read(const std::string& text, const std::string& name = "piece.svg") {
    write_durable(folder_.path() / name, text);
    return read_outline(folder_.path() / name, kSpacing_m);
  }
  /// Shapes in a drawing of 200 x 200 mm.
  ClothOutline drawn(const std::string& shapes) {
    return read(
        "<?xml version=\"1.0\"?><svg xmlns=\"http://www.w3.org/2000/svg\" width=\"200mm\" "
        "height=\"200mm\" viewBox=\"0 0 200 200\">" +
        shapes + "</svg>");
  }
  std::string refusal(const std::string& shapes) {
    try {
      drawn(shapes);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::bad_input);
      return error.what();
    }
    ADD_FAILURE() << "taken: " << shapes;
    return {};
  }

  test::TemporaryFolder folder_;
};

double area_mm2(const Polygon& ring) {
  double sum = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Eigen::Vector2d &a = ring[i], &b = ring[(i + 1) % ring.size()];
    sum += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return std::abs(sum) / (mm * mm);
}

TEST_F(Outlines, ADrawingsXIsTheWeftAndItsYTheWarp) {
  const ClothOutline outline = drawn("<rect x='10' y='20' width='100' height='50'/>");
  ASSERT_EQ(outline.outer.size(), 4U);
  EXPECT_NEAR((outline.outer[0] - Eigen::Vector2d(20, 10) * mm).norm(), 0, 1e-12);
  EXPECT_NEAR((outline.outer[1] - Eigen::Vector2d(20, 110) * mm).norm(), 0, 1e-12);
  EXPECT_NEAR((outline.outer[2] - Eigen::Vector2d(70, 110) * mm).norm(), 0, 1e-12);
}

TEST_F(Outlines, UnitsAndViewBoxGiveMillimetres) {
  const char* const shape = "<polygon points='0,0 10,0 10,10 0,10'/></svg>";
  const std::string head = "<svg xmlns='http://www.w3.org/2000/svg' ";
  const auto side = [&](const std::string& size) {
    return read(head + size + ">" + shape).outer[1].y() / mm;
  };
  EXPECT_NEAR(side("width='20cm' height='20cm' viewBox='0 0 100 100'"), 20, 1e-9);
  EXPECT_NEAR(side("width='2in' height='2in' viewBox='-5 -5 50.8 50.8'"), 15, 1e-9);
  EXPECT_NEAR(side("width='96' height='96'"), 25.4 / 9.6, 1e-9);
  for (const char* size : {"", "width='100%' height='100%' viewBox='0 0 9 9'", "width='10mm'",
                           "width='10mm' height='20mm' viewBox='0 0 10 10'",
                           "width='10mm' height='10mm' viewBox='0 0 10'"})
    EXPECT_THROW((void)side(size), Error) << size;
}

TEST_F(Outlines, WhatIsNotSeenAsItIsDrawnIsRefused) {
  const std::string piece = "<rect id='piece' x='50' y='50' width='100' height='100'/>";
  const std::string frame = "<rect width='200' height='200'/>";
  for (const char* hidden :
       {"style='display:none'", "style='opacity:1; DISPLAY : None !important'", "display='none'",
        "style='/* layer 2 */display:none'", "style='/*/ 2 */display:none/* a */'",
        "visibility='hidden'", "style='visibility:collapse'", "opacity='0'",
        "style='transform:scale(2)'", "style='stroke:red;rotate:5deg'", "clip-path='url(#a)'",
        "style='mask:url(#a)'"})
    for (const std::string& layer :
         {"<g id='frame' " + std::string(hidden) + ">" + frame + "</g>",
          "<rect id='frame' " + std::string(hidden) + " width='200' height='200'/>"})
      EXPECT_THAT(refusal(piece + layer),
                  testing::AllOf(HasSubstr("id=frame"), HasSubstr("not seen as it is drawn")));
  for (const char* sheet : {".st0{display:none;}", "rect:hover{display:none}",
                            "<![CDATA[ @media all { g { x: 5px } }]]>",
                            ".a{fill:red} .b { visibility : hidden }", "@import url(other.css);"})
    for (const char* place : {"<style>", "<defs><style type='text/css'>"}) {
      const std::string close = place[1] == 'd' ? "</style></defs>" : "</style>";
      EXPECT_THAT(refusal(fmt::format("{}{}{}{}", place, sheet, close, piece)),
                  HasSubstr("`style`"));
    }
  EXPECT_THROW((void)read("<?xml version='1.0'?><?xml-stylesheet href='a.css'?><svg width='9mm' "
                          "height='9mm'>" +
                          piece + "</svg>"),
               Error);
  EXPECT_THROW((void)read("<svg width='9mm' height='9mm' transform='scale(2)'>" + piece + "</svg>"),
               Error);
  // attributes that editors write for every layer and shape
  const ClothOutline shown = drawn(
      "<style>/* display:none */ .st0{fill:none;stroke-width:2;display:inline}</style>"
      "<g style='display:inline;opacity:0.5' visibility='visible' mask='none'>" +
      piece + "</g>");
  EXPECT_NEAR(area_mm2(shown.outer), 10000, 1e-6);
}

TEST_F(Outlines, ATransformOfMoreThanNumbersIsRefused) {
  for (const char* transform : {"translate(50px,80px)", "translate(5 6 7)", "rotate(90deg)",
                                "scale(2x)", "matrix(1 0 0 1 5 6mm)", "translate(5%)"})
    EXPECT_THAT(refusal("<rect transform='" + std::string(transform) + "' width='9' height='9'/>"),
                HasSubstr("is no transform"));
}

/// Every path command, absolute and relative, draws the same disc or square.
TEST_F(Outlines, PathsDrawWhatTheyShould) {
  const double disc = std::numbers::pi * 30 * 30;
  // A circle as a polygon with edges of 2 mm lacks (2 pi / n)^2 / 6 of its area, n = 94.
  const double lacks = std::pow(2 * std::numbers::pi / 94, 2) / 6;
  const double k = 30 * 4 * (std::numbers::sqrt2 - 1) / 3;  // within 3e-4 of a circle
  const auto text = [](double value) { return std::to_string(value) + " "; };
  for (const std::string& path :
       {std::string("M70 100a30 30 0 0 1 60 0 30 30 0 0 1-60 0z"),
        std::string("M 70,100 A 30,30 0 1,0 130,100 A 30 30 0 10 70 100"),
        "M70 100C70 " + text(100 - k) + text(100 - k) + "70 100 70S130 " + text(100 - k) +
            "130 100 " + text(100 + k) + "130 100 130 70 " + text(100 + k) + "70 100Z"})
    EXPECT_NEAR(area_mm2(drawn("<path d='" + path + "'/>").outer) / disc, 1 - lacks, 5e-4) << path;
  EXPECT_NEAR(area_mm2(drawn("<circle cx='100' cy='100' r='30'/>").outer) / disc, 1 - lacks, 1e-4);
  for (const char* path : {"M10 10H60V60H10Z", "m10 10h50v50h-50z",
                           "M10,10L60,10 60 60 10 60 10 10", "m10 10 50 0 0 50-50 0z"})
    EXPECT_NEAR(area_mm2(drawn(std::string("<path d='") + path + "'/>").outer), 2500, 1e-6) << path;
  // The area under a parabola is two thirds of height times chord; the second one mirrors it.
  const ClothOutline waves = drawn("<path d='M0 50Q25 100 50 50T100 50L100 0 0 0z'/>");
  EXPECT_NEAR(area_mm2(waves.outer), 5000, 1);
}

TEST_F(Outlines, TransformsAndGroupsMoveAndTurn) {
  const ClothOutline outline = drawn(
      "<g transform='translate(100,50) rotate(90)'><g transform='scale(2)'>"
      "<rect x='0' y='0' width='10' height='20'/></g></g>");
  EXPECT_NEAR(area_mm2(outline.outer), 800, 1e-9);
  // (10, 0) is scaled to (20, 0), rotated to (0, 20) and moved to x 100, y 70.
  EXPECT_NEAR((outline.outer[1] - Eigen::Vector2d(70, 100) * mm).norm(), 0, 1e-12);
  EXPECT_THAT(refusal("<g transform='fold(3)'><rect width='9' height='9'/></g>"),
              HasSubstr("is no transform"));
}

TEST_F(Outlines, RingsInsideAreHoles) {
  const ClothOutline outline =
      drawn("<circle cx='50' cy='50' r='10'/><path d='M0 0H100V100H0ZM70 70h9v9h-9z'/>");
  EXPECT_NEAR(area_mm2(outline.outer), 10000, 1e-6);
  ASSERT_EQ(outline.holes.size(), 2U);
  const MaterialMesh mesh = triangulated(outline, {.spacing_m = 4 * mm});
  EXPECT_NEAR(mesh.area_m2() / (mm * mm), 10000 - 81 - area_mm2(outline.holes[0]), 1e-6);
}

TEST_F(Outlines, WhatIsNoOutlineIsRefusedByName) {
  EXPECT_THAT(refusal("<path id='hem' d='M0 0H50V50H0'/>"),
              testing::AllOf(HasSubstr("a line is not closed"), HasSubstr("path id=hem")));
  EXPECT_THAT(refusal("<text>cut here</text>"), HasSubstr("<text> is no closed outline"));
  EXPECT_THAT(refusal("<path d='M0 0H50V50H0X'/>"), HasSubstr("`X` is no command"));
  EXPECT_THAT(refusal("<path d='M0 0H50V50H'/>"), HasSubstr("a number is missing"));
  EXPECT_THAT(refusal("<path d='L50 50 0 50z'/>"), HasSubstr("does not begin with M"));
  EXPECT_THAT(refusal("<path d='M0 0L50 50L50 0L0 50Z'/>"), HasSubstr("cross"));
  EXPECT_THAT(refusal("<rect width='9' height='9'/><rect x='20' width='8' height='8'/>"),
              HasSubstr("is not inside the largest one"));
  EXPECT_THAT(refusal("<polygon points='0,0 10'/>"), HasSubstr("odd number"));
  EXPECT_THAT(refusal("<rect width='a' height='9'/>"), HasSubstr("width is no number"));
  EXPECT_THAT(refusal("<rect width='9' height='9' rx='2'/>"), HasSubstr("rounded"));
  EXPECT_THAT(refusal("<title>nothing</title>"), HasSubstr("no closed outline"));
  EXPECT_THAT(refusal("<circle r='1e300'/>"), HasSubstr("reaches beyond"));
  EXPECT_THAT(refusal("<circle r='1e9'/>"), HasSubstr("reaches beyond"));
  EXPECT_THAT(refusal("<g transform='" + std::string(5000, ' ') + "'/>"), HasSubstr("too long"));
  EXPECT_THAT(refusal("<g transform='" + std::string(4000, ' ') + "'/>"), HasSubstr("be read"));
  std::string comb = "M0 0";
  for (int i = 0; i < 25000; ++i) comb += "h.01v.01";
  EXPECT_THAT(refusal("<path d='" + comb + "z'/>"), HasSubstr("more than 20000 corners"));
  std::string deep;
  for (int i = 0; i < 200; ++i) deep += "<g>";
  for (int i = 0; i < 200; ++i) deep += "</g>";
  EXPECT_THAT(refusal(deep), HasSubstr("too deep"));
  EXPECT_THROW((void)read("no xml"), Error);
  EXPECT_THROW((void)read("0,0", "piece.dxf"), Error);
}

TEST_F(Outlines, CsvHasARingPerNumber) {
  const ClothOutline outline = read(
      "ring,warp_mm,weft_mm\n0,0,0\n0,100,0\n0,100,80\n0,0,80\n0,0,0\n1,20,20\n1,40,20\n1,40,40\n",
      "piece.csv");
  EXPECT_NEAR(area_mm2(outline.outer), 8000, 1e-9);
  ASSERT_EQ(outline.holes.size(), 1U);
  EXPECT_NEAR(area_mm2(outline.holes[0]), 200, 1e-9);
  EXPECT_THROW((void)read("ring,warp_mm,weft_mm\n0,0,nothing\n", "wrong.csv"), Error);
}

/// A corner given twice, anywhere in its ring, counts once, and the mesh is not cut there.
TEST_F(Outlines, ACornerThatStandsTwiceIsOne) {
  const std::vector<std::string> corners = {"0,20,20\n", "0,180,20\n", "0,180,150\n", "0,100,190\n",
                                            "0,20,150\n"};
  const auto with_twice = [&](std::size_t twice) {
    std::string text = "ring,warp_mm,weft_mm\n";
    for (std::size_t k = 0; k < corners.size(); ++k)
      text += corners[k] + (k == twice ? corners[k] : "");
    return read(text, "piece.csv");
  };
  const ClothOutline plain = with_twice(corners.size());
  for (std::size_t twice = 0; twice < corners.size(); ++twice) {
    EXPECT_EQ(with_twice(twice).outer, plain.outer) << twice;
    // Passed on unchanged, it does not tear the mesh.
    ClothOutline doubled = plain;
    doubled.outer.insert(doubled.outer.begin() + static_cast<std::ptrdiff_t>(twice),
                         doubled.outer[twice]);
    for (const double spacing_mm : {10, 15})
      EXPECT_NEAR(triangulated(doubled, {.spacing_m = spacing_mm * mm}).border_m(),
                  triangulated(plain, {.spacing_m = spacing_mm * mm}).border_m(), 1e-9)
          << twice << ' ' << spacing_mm;
  }
  const MaterialMesh mesh = triangulated(plain, {.spacing_m = 15 * mm});
  EXPECT_NEAR(mesh.border_m() / mm, 160 + 130 + 2 * std::hypot(80, 40) + 130, 1e-6);
}

TEST_F(Outlines, RingsThatTouchAreRefusedByName) {
  const std::string square = "0,0,0\n0,90,0\n0,90,90\n0,0,90\n";
  const std::string hole = "1,30,30\n1,60,30\n1,60,60\n1,30,60\n";
  const auto ring = [](std::string text, char number) {
    for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1) text[at] = number;
    return text;
  };
  const auto refused = [&](const std::string& corners, const std::string& why) {
    try {
      (void)read("ring,warp_mm,weft_mm\n" + corners, "wrong.csv");
      ADD_FAILURE() << "taken: " << corners;
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), testing::AllOf(HasSubstr(why), HasSubstr("wrong.csv")));
    }
  };
  EXPECT_EQ(read("ring,warp_mm,weft_mm\n" + square + hole, "piece.csv").holes.size(), 1U);
  refused(square + ring(square, '1'), "stands there twice");
  refused(square + hole + ring(hole, '2'), "stands there twice");
  refused(square + hole + "2,40,40\n2,50,40\n2,50,50\n", "is inside a hole");
  refused("0,0,0\n0,90,0\n0,90,90\n0,45,90\n0,45,120\n0,45,90\n0,0,90\n", "runs back on itself");
  refused("0,0,0\n0,90,0\n0,90,90\n0,40,90\n0,60,90\n0,0,90\n", "runs back on itself");
  refused(square + "1,0,30\n1,30,30\n1,30,60\n", "touch near warp 0.0, weft 30.0 mm");
  refused("0,20,20\n0,180,180\n0,180,20\n0,20,180\n", "cross near warp 100.0, weft 100.0 mm");
  refused("0,0,0\n0,90,0\n0,45,45\n0,90,90\n0,0,90\n0,45,45\n", "touch near");
  refused(square + "1,30,30\n1,60,30\n1,60,30\n", "fewer than three corners");
  refused(square + hole + square, "goes on after another one");
  EXPECT_THAT(refusal("<rect width='90' height='90'/><path d='M30 30H60Z'/>"),
              HasSubstr("fewer than three corners"));
}

}  // namespace
}  // namespace drape::simulate

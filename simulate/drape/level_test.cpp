// SPDX-License-Identifier: Apache-2.0

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/drape/smooth_surface.hpp"
#include "simulate/drape/test_drape.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

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
  const auto found = level.first_order(rest.rest, forces);
  if (!found) return 1;
  ClothMoment moments[2] = {rest.rest, rest.rest};
  for (int k = 0; k < 2; ++k) {
    level.set_gravity(scene.gravity_m_per_s2 + (k == 0 ? part : -part) * change);
    EXPECT_TRUE(level.rest(moments[k]).at_rest);
  }
  double wrong = 0, all = 0;
  for (int i = 0; i < points; ++i) {
    const Vector3d moved = (moments[0].state[i] - moments[1].state[i]) / (2 * part);
    wrong += (moved - (*found)[i]).squaredNorm();
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

  StatedError(const DrapeCase& drape, const std::vector<double>& spacings_m, double order)
      : stated_m(0), true_m(std::pow(spacings_m.back(), order)) {
    std::vector<LevelReport> levels;
    std::vector<Eigen::MatrixX3d> marks;
    for (const double spacing : spacings_m) {
      levels.push_back({spacing, 0, {}, {}});
      marks.emplace_back(Eigen::RowVector3d(0, 0, std::pow(spacing, order)));
      if (marks.size() > 1) levels.back().moved_m = (marks.back() - marks[marks.size() - 2]).norm();
    }
    stated_m = mesh_error_m(drape, levels, marks)(0);
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

}  // namespace
}  // namespace drape::simulate

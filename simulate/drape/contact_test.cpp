// SPDX-License-Identifier: Apache-2.0
// Forces of objects on a cloth.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <variant>

#include "core/units.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/drape/pushes.hpp"
#include "simulate/drape/test_drape.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::IsEmpty;
using units::mm;

/// A box of 50 mm with rounded edges; the cloth lies on its top.
Scene block(double friction) {
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "block";
  scene.table_z_m = -0.2;
  scene.friction = friction;
  Box box;
  box.size_m = {50 * mm, 50 * mm, 50 * mm};
  box.edge_radius_m = 1 * mm;
  box.world_from_box.translation_m = {0, 0, -25 * mm};
  scene.obstacles = {box};
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0, 0, 1 * mm);
  return scene;
}

MeshCloth small_cloth() {
  MeshOptions options;
  options.spacing_m = 10 * mm;
  return {
      triangulated({{{0, 0}, {60 * mm, 0}, {60 * mm, 60 * mm}, {0, 60 * mm}}, {}, {}, {}}, options),
      cotton()};
}

TEST(ClothSurface, IsExactForQuadraticsAndKeepsForces) {
  const MeshCloth cloth = small_cloth();
  const auto map = [](const Vector2d& p) {
    const double u = p.x(), v = p.y();
    return MeshCloth::Jet{
        {u, v, 9 * u * u - 5 * u * v + 4 * v * v}, {1, 0, 18 * u - 5 * v}, {0, 1, -5 * u + 8 * v}};
  };
  const ClothSurface surface(cloth);
  const MeshCloth::State nodes = surface.nodes(cloth.state_of(map));
  const MaterialMesh& mesh = cloth.mesh();
  for (std::size_t e = 0; e < mesh.edges.size(); ++e) {
    const Vector2d middle =
        (mesh.points_m[mesh.edges[e].from] + mesh.points_m[mesh.edges[e].to]) / 2;
    EXPECT_LT((nodes[mesh.points_m.size() + e] - map(middle).x).norm(), 1e-12);
  }
  // A force on a side's midpoint gives points an equal total force, and gives moments to the sides.
  MeshCloth::State on_nodes(nodes.size(), Vector3d::Zero()), force(nodes.size(), Vector3d::Zero());
  on_nodes[nodes.size() - 3] = {0.1, -0.2, 0.3};
  surface.add_forces(on_nodes, force);
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < cloth.points(); ++i) sum += force[i];
  EXPECT_LT((sum - Vector3d(0.1, -0.2, 0.3)).norm(), 1e-12);
}

void expect_gradient(ObjectPushes& pushes, const MeshCloth::State& state) {
  MeshCloth::State force(state.size(), Vector3d::Zero());
  pushes.add_forces(state, force);
  double largest = 0;
  for (const Vector3d& f : force) largest = std::max(largest, f.norm());
  ASSERT_GT(largest, 0);
  constexpr double kStep = 1e-9;
  for (std::size_t i = 0; i < state.size(); i += 3)
    for (int axis = 0; axis < 3; ++axis) {
      MeshCloth::State to = state;
      to[i][axis] += kStep;
      const double after = pushes.energy_j(to);
      to[i][axis] -= 2 * kStep;
      const double before = pushes.energy_j(to);
      // Rounding of energies of a microjoule over the step, and curvature of the law within a step.
      ASSERT_NEAR((before - after) / (2 * kStep), force[i][axis], 1e-3 * largest) << i;
    }
}

/// Forces are the gradient of the energy, also with friction between two updates.
TEST(ObjectPushes, ForcesAreTheGradientOfTheirEnergy) {
  const MeshCloth cloth = small_cloth();
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  const Surroundings around(block(0.3));
  ObjectPushes pushes(cloth, held, around, 0.3, 9.81);
  // Bent over an edge of the box, with a penetration of about a tenth of a millimetre.
  const auto bent = [](double sunk) {
    return [sunk](const Vector2d& p) {
      const double out = p.x(), turn = 12 * out;
      return MeshCloth::Jet{
          {22 * mm + std::sin(turn) / 12, p.y() - 30 * mm, -sunk - (1 - std::cos(turn)) / 12},
          {std::cos(turn), 0, -std::sin(turn)},
          {0, 1, 0}};
    };
  };
  pushes.settle(cloth.state_of(bent(0.1 * mm)));
  MeshCloth::State state = cloth.state_of(bent(0.12 * mm));
  for (int i = 0; i < cloth.points(); ++i) state[i] += 1e-5 * Vector3d(std::sin(i), std::cos(i), 0);
  const std::vector<ContactForce> stated = pushes.stated(state);
  EXPECT_TRUE(std::any_of(stated.begin(), stated.end(),
                          [](const ContactForce& of) { return of.weight[0] < 1; }));
  expect_gradient(pushes, state);
}

/// A cylinder of 20 mm radius that lies on the table across gravity's slope.
Scene slope() {
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "slope";
  scene.table_z_m = 0;
  Cylinder log;
  log.radius_m = 20 * mm;
  log.height_m = 300 * mm;
  log.world_from_cylinder.rotation =
      Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  log.world_from_cylinder.translation_m.z() = log.radius_m;
  scene.obstacles = {log};
  scene.gravity_m_per_s2 = 9.81 * Vector3d(std::sin(0.2), 0, -std::cos(0.2));
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(-40 * mm, 0, 0.5 * mm);
  return scene;
}

/// Half the width of the gap below the cylinder that is closed.
double closed_half_m() {
  const double over = 20 * mm - kClosed_m;
  return std::sqrt(20 * mm * 20 * mm - over * over);
}

TEST(ObjectPushes, ForcesInAClosedGapAreTheGradientOfTheirEnergy) {
  const MeshCloth cloth = small_cloth();
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  const Surroundings around(slope(), kClosed_m);
  ObjectPushes pushes(cloth, held, around, 0.3, 9.81);
  const auto flat = [](double entered) {
    return [entered](const Vector2d& p) {
      return MeshCloth::Jet{{p.x() - 60 * mm - closed_half_m() + entered, p.y() - 30 * mm, 1e-5},
                            {1, 0, 0},
                            {0, 1, 0}};
    };
  };
  pushes.settle(cloth.state_of(flat(0.1 * mm)));
  MeshCloth::State state = cloth.state_of(flat(0.12 * mm));
  for (int i = 0; i < cloth.points(); ++i) state[i] += 1e-6 * Vector3d(std::sin(i), std::cos(i), 0);
  expect_gradient(pushes, state);
}

// Cloth slides down a tilted table to a log and does not slip between the two.
TEST(ObjectPushes, AClosedGapHoldsTheClothsWeight) {
  const Scene scene = slope();
  const DrapeCase drape = drape_case(scene, square_patch(60 * mm), std::nullopt, cotton());
  DrapeOptions options;
  options.spacing_m = options.coarsest_m;
  const Drape found = drape_cloth(drape, options);
  ASSERT_TRUE(found.at_rest()) << found.levels.back().rest.why;
  const MeshJudgement judged =
      judge_drape(*found.level, found.rest, scene, options.descent.residual);
  EXPECT_THAT(judged.refusals, IsEmpty());
  double farthest_m = -1;
  for (const Vector3d& node : found.level->surface(found.rest))
    farthest_m = std::max(farthest_m, drape.local.to_world(node).x());
  EXPECT_NEAR(farthest_m, -closed_half_m(), 0.05 * mm);  // depth of a contact point
  double pushed_n = 0;
  for (const ContactForce& force : found.level->contact_forces(found.rest))
    if (force.shape == 0) pushed_n -= force.force_in_world.x();
  const double weight_n = 0.15 * 60 * mm * 60 * mm * 9.81;
  EXPECT_NEAR(pushed_n, weight_n * std::sin(0.2), 0.01 * weight_n * std::sin(0.2));
}

/// Products with the second derivative equal differences of forces, both for sticking and for
/// sliding friction.
TEST(ObjectPushes, ProductsAreDifferencesOfForces) {
  const MeshCloth cloth = small_cloth();
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  const Surroundings around(block(0.3));
  ObjectPushes pushes(cloth, held, around, 0.3, 9.81);
  const auto flat = [](double sunk, double along) {
    return [=](const Vector2d& p) {
      return MeshCloth::Jet{
          {p.x() - 20 * mm + along, p.y() - 20 * mm, -sunk}, {1, 0, 0}, {0, 1, 0}};
    };
  };
  pushes.settle(cloth.state_of(flat(1e-7, 0)));
  for (const double along : {1e-8, 1e-6}) {
    const MeshCloth::State state = cloth.state_of(flat(2e-7, along));
    MeshCloth::State direction(state.size());
    for (std::size_t i = 0; i < direction.size(); ++i) {
      const auto t = static_cast<double>(i);
      direction[i] = Vector3d(std::sin(t), std::cos(2 * t), std::sin(3 * t));
    }
    MeshCloth::State product(state.size(), Vector3d::Zero()), before = product, after = product;
    pushes.add_products(state, direction, product);
    constexpr double kStep = 1e-10;
    MeshCloth::State less = state, more = state;
    for (std::size_t i = 0; i < state.size(); ++i) {
      less[i] -= kStep * direction[i];
      more[i] += kStep * direction[i];
    }
    pushes.add_forces(less, before);
    pushes.add_forces(more, after);
    double largest = 0;
    for (const Vector3d& p : product) largest = std::max(largest, p.norm());
    ASSERT_GT(largest, 0);
    for (std::size_t i = 0; i < state.size(); ++i)
      ASSERT_LT((product[i] - (before[i] - after[i]) / (2 * kStep)).norm(), 1e-3 * largest) << i;
  }
}

/// A cloth continues from its contact memory as if uninterrupted, and another mesh takes over its
/// friction forces: a refined level does not slide to the rest without friction.
TEST(ContactMemory, IsExactOnItsMeshAndCarriesFrictionToAnother) {
  Scene scene = ball(0.3);
  scene.start.centre_in_world = Vector3d(6 * mm, 9 * mm, 1 * mm);
  const DrapeCase drape = case_of(scene);
  const DrapeOptions options;
  DrapeLevel coarse(drape, options, 10 * mm);
  ClothMoment moment = coarse.start();
  ASSERT_TRUE(coarse.fall(moment).at_rest);
  const MeshCloth::State before = moment.state;
  const std::vector<ContactForce> forces = coarse.contact_forces(moment);
  const RestReport again = coarse.rest(moment);
  EXPECT_TRUE(again.at_rest);
  EXPECT_EQ(again.steps, 0);
  EXPECT_EQ(moment.state, before);
  const std::vector<ContactForce> same = coarse.contact_forces(moment);
  ASSERT_EQ(same.size(), forces.size());
  for (std::size_t k = 0; k < same.size(); ++k)
    EXPECT_LT((same[k].force_in_world - forces[k].force_in_world).norm(),
              1e-9 * forces[k].force_in_world.norm());

  DrapeLevel fine(drape, options, 5 * mm);
  std::vector<Vector2d> marks;
  for (int i = 1; i < 12; ++i)
    for (int j = 1; j < 12; ++j) marks.emplace_back(10 * mm * i, 10 * mm * j);
  const auto place = [&](ClothMoment start) {
    EXPECT_TRUE(fine.rest(start).at_rest);
    return fine.places(start, marks);
  };
  const ClothMoment carried = fine.carried(coarse, moment);
  ClothMoment forgets = carried;
  forgets.contact = nullptr;
  const Eigen::MatrixX3d there = coarse.places(moment, marks);
  EXPECT_LT(mean_distance_m(place(carried), there), 0.5 * mean_distance_m(place(forgets), there));
}

/// Penetration of the surface, sampled every quarter of a millimetre.
double deepest_m(const DrapeLevel& level, const ClothMoment& moment) {
  const Surroundings& around = *level.drape().around;
  const MeshCloth::State nodes = level.surface(moment);
  double deepest = 0;
  for (const auto& f : facets_of(level.cloth().mesh())) {
    const int cuts = static_cast<int>(std::ceil(level.spacing_m() / 2 / (0.25 * mm)));
    for (int i = 0; i <= cuts; ++i)
      for (int j = 0; i + j <= cuts; ++j) {
        const double u = double(i) / cuts, v = double(j) / cuts;
        const Vector3d p = (1 - u - v) * nodes[f[0]] + u * nodes[f[1]] + v * nodes[f[2]];
        for (int shape = 0; shape < around.count(); ++shape)
          deepest = std::max(deepest, -around.gap_m(shape, p));
      }
  }
  return deepest;
}

/// Edges and corners of any radius are penetrated by a tenth of a millimetre at most, on a coarse
/// mesh by three times as much.
TEST(Drape, SharpEdgesPressBetweenNodes) {
  for (const double radius : {0.0, 0.01 * mm, 1 * mm}) {
    Scene scene = block(0.3);
    std::get<Box>(scene.obstacles.front()).edge_radius_m = radius;
    const DrapeCase drape = drape_case(scene, square_patch(100 * mm), std::nullopt, cotton());
    DrapeOptions options;
    options.spacing_m = 5 * mm;
    const Drape found = drape_cloth(drape, options);
    ASSERT_TRUE(found.at_rest()) << found.levels.back().rest.why;
    EXPECT_LT(deepest_m(*found.level, found.rest), 0.1 * mm) << radius;
    EXPECT_THAT(judge_drape(*found.level, found.rest, scene, options.descent.residual).refusals,
                IsEmpty())
        << radius;
  }
}

/// A step of the fall is twice as long as this plate is thick.
TEST(ObjectPushes, NoPathLeadsThroughAThinPlate) {
  const MeshCloth cloth = small_cloth();
  const std::vector<bool> held(static_cast<std::size_t>(cloth.unknowns()), false);
  Surroundings around;
  Box plate;
  plate.size_m = {100 * mm, 100 * mm, 1 * mm};
  around.add(plate);
  ObjectPushes pushes(cloth, held, around, 0.3, 9.81);
  const auto at = [&](double z) {
    return cloth.state_of([z](const Vector2d& p) {
      return MeshCloth::Jet{{p.x() - 30 * mm, p.y() - 30 * mm, z}, {1, 0, 0}, {0, 1, 0}};
    });
  };
  const double part = pushes.clear_part(at(1 * mm), at(-1 * mm), false);
  EXPECT_GT(part, 0.2);
  EXPECT_LE(part, 0.5);
  EXPECT_EQ(pushes.clear_part(at(3 * mm), at(1 * mm), false), 1);
}

}  // namespace
}  // namespace drape::simulate

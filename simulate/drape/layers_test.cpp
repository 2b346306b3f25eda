// SPDX-License-Identifier: Apache-2.0
// A cloth that touches itself.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/units.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/drape/drape.hpp"
#include "simulate/drape/pushes.hpp"
#include "simulate/drape/test_drape.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;
using State = MeshCloth::State;

constexpr double kThickness = 0.5 * mm, kGravity = 9.80665;

Print whole_patch() {
  return square_patch(200 * mm);
}

MeshCloth strip(double spacing_m) {
  MeshOptions options;
  options.spacing_m = spacing_m;
  return {triangulated({{{0, 0}, {0.1, 0}, {0.1, 0.03}, {0, 0.03}}, {}, {}, {}}, options),
          cotton()};
}

/// A hairpin with layers `gap_m` apart, the upper one `down_m` lower at its end and rotated in
/// plan.
State hairpin(const MeshCloth& cloth, double gap_m, double down_m = 0) {
  const double radius = gap_m / 2, bend = std::numbers::pi * radius, half = 0.05 - bend / 2;
  return cloth.state_of([&](const Vector2d& p) {
    const double u = p.x(), v = p.y();
    if (u <= half) return MeshCloth::Jet{{u, v, 0}, {1, 0, 0}, {0, 1, 0}};
    if (u <= half + bend) {
      const double turn = (u - half) / radius;
      return MeshCloth::Jet{{half + radius * std::sin(turn), v, radius * (1 - std::cos(turn))},
                            {std::cos(turn), 0, std::sin(turn)},
                            {0, 1, 0}};
    }
    const double back = u - half - bend, part = back / half;
    return MeshCloth::Jet{{half - back, v + 0.07 * back, gap_m - down_m * part * part},
                          {-1, 0.07, -2 * down_m * part / half},
                          {0, 1, 0}};
  });
}

/// Distances between points of the surface's facets, at half the edge length.
SelfDistance distance_of(const MaterialMesh& mesh, const State& surface, double spacing_m) {
  std::vector<Vector2d> material = mesh.points_m;
  for (const MaterialMesh::Edge& edge : mesh.edges)
    material.push_back((mesh.points_m[edge.from] + mesh.points_m[edge.to]) / 2);
  return self_distance(facets_of(mesh), material, spacing_m / 2, surface);
}

TEST(LayerPushes, ForcesAreTheGradientOfTheirEnergy) {
  const MeshCloth cloth = strip(5 * mm);
  // above and below half a thickness
  for (const double gap : {0.8 * kThickness, 0.3 * kThickness}) {
    LayerPushes pushes(cloth, 0.3, kGravity, kThickness);
    State state = hairpin(cloth, gap);
    pushes.settle(state);
    for (int i = 0; i < cloth.points(); ++i)
      state[i] += 1e-6 * Vector3d(std::sin(i), std::cos(i), std::sin(2 * i));
    State force(state.size(), Vector3d::Zero());
    pushes.add_forces(state, force);
    int edges = 0;
    for (const ContactForce& of : pushes.stated(state, 1)) edges += of.weight[1] > 0 ? 1 : 0;
    EXPECT_GT(edges, 0);
    double largest = 0;
    for (const Vector3d& f : force) largest = std::max(largest, f.norm());
    ASSERT_GT(largest, 0);
    constexpr double kStep = 1e-9;
    for (std::size_t i = 0; i < state.size(); i += 3)
      for (int axis = 0; axis < 3; ++axis) {
        State to = state;
        to[i][axis] += kStep;
        const double after = pushes.energy_j(to);
        to[i][axis] -= 2 * kStep;
        const double before = pushes.energy_j(to);
        ASSERT_NEAR((before - after) / (2 * kStep), force[i][axis], 1e-3 * largest) << i;
      }
  }
}

/// A layer moved along the other is held by springs at first, then by the coefficient times the
/// normal force, in any direction.
TEST(LayerPushes, HoldEachOtherAsCoulombSays) {
  constexpr double kLayerFriction = 0.3;
  const MeshCloth cloth = strip(5 * mm);
  LayerPushes pushes(cloth, kLayerFriction, kGravity, kThickness);
  const State start = hairpin(cloth, 0.98 * kThickness);
  pushes.settle(start);
  const int shape = 1;
  State state = start;
  const auto lead = [&](double along) {
    for (int i = 0; i < cloth.points(); ++i)
      if (cloth.mesh().points_m[i].x() > 0.05) state[i].y() += along;
    pushes.settle(state);
    // Force that resists motion along +y, without the bend's. Forces are on the first pieces.
    const State nodes = ClothSurface(cloth).nodes(state);
    double push = 0, hold = 0;
    for (const ContactForce& of : pushes.stated(state, shape)) {
      if (std::any_of(of.particle.begin(), of.particle.end(),
                      [&](int node) { return nodes[node].x() > 0.04; }))
        continue;
      push += std::abs(of.force_in_world.z());
      hold -= std::copysign(1.0, of.force_in_world.z()) * of.force_in_world.y();
    }
    return hold / push;
  };
  const double sticks = lead(0.2e-6);
  EXPECT_GT(sticks, 0);
  EXPECT_LT(sticks, 0.5 * kLayerFriction);
  for (const double sign : {1.0, -1.0}) {
    double slides = 0;
    for (int step = 0; step < 10; ++step) slides = lead(sign * 10e-6);
    EXPECT_NEAR(slides, sign * kLayerFriction, 0.01 * kLayerFriction);
  }
}

/// A flat cloth does not press on itself, however fine its mesh.
TEST(LayerPushes, NeighboursDoNotPressForBeingNeighbours) {
  const MeshCloth cloth = strip(2 * mm);
  LayerPushes pushes(cloth, 0.3, kGravity, 3 * mm);
  const State flat = cloth.state_of([](const Vector2d& p) {
    return MeshCloth::Jet{{p.x(), p.y(), 0}, {1, 0, 0}, {0, 1, 0}};
  });
  EXPECT_EQ(pushes.energy_j(flat), 0);
}

TEST(LayerPushes, NoPathLeadsThroughAnotherLayer) {
  const MeshCloth cloth = strip(5 * mm);
  const ClothSurface surface(cloth);
  const State from = hairpin(cloth, 4 * mm);
  const auto least = [&](const State& state) {
    return distance_of(cloth.mesh(), surface.nodes(state), 5 * mm);
  };
  const double start = 4 * mm;
  for (const double down : {5 * mm, 30 * mm}) {
    const State to = hairpin(cloth, 4 * mm, down);
    ASSERT_GT(least(to).crossings, 0);
    for (const bool led : {false, true}) {
      LayerPushes pushes(cloth, 0.3, kGravity, kThickness);
      const double part = pushes.clear_part(from, to, led);
      EXPECT_GT(part, 0);
      ASSERT_LT(part, 1);
      State cut = from;
      for (std::size_t i = 0; i < cut.size(); ++i) cut[i] += part * (to[i] - from[i]);
      const SelfDistance found = least(cut);
      EXPECT_EQ(found.crossings, 0);
      EXPECT_GT(found.least_m.value_or(start), led ? 0.5 * kThickness : 0.2 * start - 1e-9);
    }
  }
  // once apart it can move freely
  LayerPushes pushes(cloth, 0.3, kGravity, kThickness);
  EXPECT_EQ(pushes.clear_part(from, hairpin(cloth, 4 * mm, -10 * mm), false), 1);
}

/// Hung from two corners 10 mm apart, its sides would swing through each other.
Scene curtain() {
  Scene scene;
  scene.file = "scene.toml";
  scene.name = "curtain";
  scene.table_z_m = -1;
  scene.friction = 0.3;
  scene.start.mode = StartMode::flat;
  scene.start.centre_in_world = Vector3d(0, 0, 0);
  for (const double side : {-1.0, 1.0}) {
    Pin pin;
    pin.at_material_m = {0, 100 * mm + side * 100 * mm};
    pin.point_in_world = Vector3d(side * 5 * mm, 100 * mm, 0);
    scene.pins.push_back(pin);
  }
  return scene;
}

/// checker/mesh_rest_test.cpp tests that the checker refuses impossible forces of layers.
TEST(Layers, AClothThatMeetsItselfRestsWithItsLayersApart) {
  const Scene scene = curtain();
  const DrapeCase drape = drape_case(scene, whole_patch(), std::nullopt, cotton());
  DrapeOptions options;
  options.spacing_m = 10 * mm;
  options.thickness_m = 0;
  const Drape through = drape_cloth(drape, options);
  EXPECT_EQ(through.rest.layers_apart_m, 0);
  EXPECT_TRUE(through.level->meets_itself(through.rest));
  const auto refusals = [&](const Drape& found) {
    return judge_drape(*found.level, found.rest, scene, options.descent.residual).refusals;
  };
  EXPECT_THAT(refusals(through), Contains(HasSubstr("passes through itself")));
  options.thickness_m = kThickness;
  const Drape apart = drape_cloth(drape, options);
  EXPECT_EQ(apart.rest.layers_apart_m, kThickness);
  ASSERT_TRUE(apart.at_rest()) << apart.levels.back().rest.why;
  EXPECT_THAT(refusals(apart), IsEmpty());
  const SelfDistance found =
      distance_of(apart.level->cloth().mesh(), apart.level->surface(apart.rest), 10 * mm);
  EXPECT_EQ(found.crossings, 0);
  ASSERT_TRUE(found.least_m.has_value());
  EXPECT_GT(*found.least_m, 0.5 * kThickness);
  EXPECT_LT(*found.least_m, kThickness);
  const auto forces = apart.level->contact_forces(apart.rest);
  EXPECT_TRUE(std::any_of(forces.begin(), forces.end(), [&](const ContactForce& force) {
    return force.shape == drape.around->count();
  }));
}

/// A cloth that does not touch itself gives the same numbers with and without layers.
TEST(Layers, OtherClothsAreAsTheyWere) {
  const DrapeCase drape = case_of(ball(0.3));
  DrapeOptions options;
  options.spacing_m = 10 * mm;
  const Drape with = drape_cloth(drape, options);
  options.thickness_m = 0;
  const Drape without = drape_cloth(drape, options);
  EXPECT_EQ(with.rest.layers_apart_m, 0);
  EXPECT_EQ(with.rest.state, without.rest.state);
}

}  // namespace
}  // namespace drape::simulate

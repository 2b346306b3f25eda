// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_rest.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "simulate/mesh/cusick.hpp"
#include "simulate/programs/mesh_rest_of.hpp"

namespace drape::simulate {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

ClothLaws laws_of(bool friction) {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = {800, {{0.01, 400}}};
  laws.tensile[1] = {600, {}};
  laws.shear = {30, {{0.05, 10}}};
  laws.bending[0] = {12e-6, {{30, -3e-6}}};
  laws.bending[1] = {8e-6, {}};
  laws.twist_n_m = 10e-6;
  if (!friction) return laws;
  const FrictionStack bending{{{12e-6, 6e-5, 0}, {4e-6, 4e-5, 0}}};
  laws.friction = ClothFriction{{bending, bending}, {{{60, 0.3, 0.5}}}};
  return laws;
}

CusickOptions options_of() {
  CusickOptions options;
  options.disc_m = 0.127;
  options.specimen_m = 0.254;
  options.spacing_m = 0.020;
  options.lowering_steps = 1;
  options.lowering_s = 0;
  options.motion.step_s = 8e-3;
  // The rest of its motion it loses in the last rest
  options.motion.longest_s = 0.2;
  return options;
}

MeshRest rest_of(const CusickDrape& drape, const ClothLaws& laws) {
  MeshRest rest = mesh_rest_of(drape.mesh, drape.state, laws, drape.memory);
  rest.disc_radius_m = options_of().disc_m / 2;
  rest.residual_tolerance = DescentOptions{}.residual;
  return rest;
}

class MeshRests : public testing::TestWithParam<bool> {
 protected:
  MeshRests() : laws_(laws_of(GetParam())), drape_(cusick_drape(laws_, options_of())) {}

  [[nodiscard]] MeshRest rest() const { return rest_of(drape_, laws_); }
  /// The point of the hem that hangs lowest.
  [[nodiscard]] std::size_t lowest() const {
    std::size_t at = 0;
    for (std::size_t i = 0; i < drape_.mesh.points_m.size(); ++i)
      if (drape_.state[i].z() < drape_.state[at].z()) at = i;
    return at;
  }

  ClothLaws laws_;
  CusickDrape drape_;
};

TEST_P(MeshRests, ARestIsAcceptedWithTheSolversNumbers) {
  ASSERT_TRUE(drape_.report.at_rest);
  const MeshJudgement found = judge_mesh(rest());
  EXPECT_THAT(found.refusals, IsEmpty());
  EXPECT_NEAR(found.residual, drape_.report.residual, 1e-6);
  double height_j = 0;
  MeshCloth cloth(drape_.mesh, laws_);
  for (int i = 0; i < cloth.points(); ++i)
    height_j += cloth.mass_kg()[i] * 9.80665 * drape_.state[i].z();
  EXPECT_NEAR((found.energy_j + height_j) / drape_.report.energy_j, 1, 1e-9);
  EXPECT_EQ(drape_.report.dissipated_j > 0, GetParam()) << "friction alone takes something";
}

TEST_P(MeshRests, WhatIsNoRestIsRefused) {
  MeshRest moved = rest();
  moved.points_m[lowest()].z() += 2e-4;
  EXPECT_THAT(judge_mesh(moved).refusals, Contains(HasSubstr("is left on a point")));
  MeshRest turned = rest();
  turned.of_sides.back() *= 1.05;
  EXPECT_THAT(judge_mesh(turned).refusals, Not(IsEmpty()));
  MeshRest stiffer = rest();
  stiffer.laws.bending[0].slope *= 1.05;
  EXPECT_THAT(judge_mesh(stiffer).refusals, Contains(HasSubstr("is left on a point")));
  MeshRest heavier = rest();
  heavier.laws.density_kg_per_m2 *= 1.01;
  EXPECT_THAT(judge_mesh(heavier).refusals, Contains(HasSubstr("is left on a point")));
}

TEST_P(MeshRests, HeldClothAndTheCylinderAreJudged) {
  std::size_t held = 0;
  while (drape_.mesh.points_m[held].norm() > 0.05) ++held;
  MeshRest lifted = rest();
  lifted.points_m[held].z() += 1e-6;
  EXPECT_THAT(judge_mesh(lifted).refusals, Contains(HasSubstr("held point")));
  MeshRest inside = rest();
  inside.points_m[lowest()].head<2>() *= 0.3;
  EXPECT_THAT(judge_mesh(inside).refusals, Contains(HasSubstr("cylinder")));
}

TEST_P(MeshRests, ListsThatDoNotFitAreRefused) {
  MeshRest short_of_one = rest();
  short_of_one.of_sides.pop_back();
  EXPECT_THAT(judge_mesh(short_of_one).refusals, Contains(HasSubstr("do not fit")));
  MeshRest no_number = rest();
  no_number.points_m[lowest()].x() = std::nan("");
  EXPECT_THAT(judge_mesh(no_number).refusals, Contains(HasSubstr("do not fit")));
  MeshRest beyond = rest();
  beyond.triangles.front()[1] = 1 << 30;
  EXPECT_THAT(judge_mesh(beyond).refusals, Contains(HasSubstr("do not fit")));
  MeshRest backwards = rest();
  std::swap(backwards.triangles.front()[0], backwards.triangles.front()[1]);
  EXPECT_THAT(judge_mesh(backwards).refusals, Contains(HasSubstr("turned over")));
}

INSTANTIATE_TEST_SUITE_P(Friction, MeshRests, testing::Bool());

/// Tilted gravity presses one side of the cloth on the cylinder.
TEST_P(MeshRests, ClothThatPressesOnTheCylinderRests) {
  CusickOptions options = options_of();
  options.descent.gravity_m_per_s2 = {10, 0, -9};
  const CusickDrape drape = cusick_drape(laws_, options);
  ASSERT_TRUE(drape.report.at_rest);
  MeshRest rest = rest_of(drape, laws_);
  rest.gravity_m_per_s2 = options.descent.gravity_m_per_s2;
  const MeshJudgement found = judge_mesh(rest);
  EXPECT_THAT(found.refusals, IsEmpty());
  EXPECT_NEAR(found.residual, drape.report.residual, 1e-6);
  const double radius = options.disc_m / 2;
  double least = 2;
  for (const Eigen::Vector3d& p : rest.points_m)
    if (p.z() < 0) least = std::min(least, p.head<2>().norm() / radius);
  EXPECT_LE(least, 1 - 1e-6) << "nothing presses";
  EXPECT_GE(least, 1 - 1e-5);
}

/// Laid on a coarser mesh, it ends as a rest of its own.
TEST_P(MeshRests, AShapeThatWasCarriedOverRests) {
  CusickOptions options = options_of();
  options.spacing_m = options.disc_m / 16;
  options.laid_coarser = 1.25;
  const CusickDrape carried = cusick_drape(laws_, options);
  EXPECT_GT(carried.mesh.points_m.size(), 2 * drape_.mesh.points_m.size());
  ASSERT_TRUE(carried.report.at_rest);
  EXPECT_THAT(judge_mesh(rest_of(carried, laws_)).refusals, IsEmpty());
}

TEST(MeshRest, ForgottenSlipsAreRefused) {
  const ClothLaws laws = laws_of(true);
  MeshRest rest = rest_of(cusick_drape(laws, options_of()), laws);
  EXPECT_THAT(judge_mesh(rest).refusals, IsEmpty());
  for (double& slip : rest.memory.bending[0]) slip = 0;
  EXPECT_THAT(judge_mesh(rest).refusals, Contains(HasSubstr("friction element")));
}

/// Two flat strips that cross each other, far from the disc.
TEST(MeshRest, ClothThroughClothIsFound) {
  MeshRest rest;
  rest.laws = laws_of(false);
  rest.disc_radius_m = 1e-6;
  const auto add = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                       const Eigen::Vector3d& v, double at) {
    const int first = static_cast<int>(rest.points_m.size());
    for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {0, 1}}) {
      rest.material_m.emplace_back(at + 0.1 * a, at + 0.1 * b);
      rest.points_m.emplace_back(corner + a * u + b * v);
    }
    rest.triangles.push_back({first, first + 1, first + 2});
    for (const auto& side :
         {std::array{first, first + 1}, {first, first + 2}, {first + 1, first + 2}})
      rest.sides.push_back(side);
    rest.of_sides.resize(rest.sides.size(), Eigen::Vector3d::Zero());
  };
  add({0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, 1);
  add({0.02, 0.02, -0.03}, {0, 0, 0.1}, {0.02, 0.02, 0}, 2);
  EXPECT_GT(judge_mesh(rest).crossings, 0);
  for (int i = 3; i < 6; ++i) rest.points_m[i].x() += 1;
  EXPECT_EQ(judge_mesh(rest).crossings, 0);
}

}  // namespace
}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "simulate/equilibrium/contacts.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kSunk_m = 2e-6;

void move_by(Field& x, int i, const Vector3d& displacement) {
  const std::size_t n = x.size() / 3;
  for (std::size_t axis = 0; axis < 3; ++axis)
    x[axis * n + i] += displacement[static_cast<int>(axis)];
}

/// A flat sheet pressed into a table that has just slid by some millimetres.
struct Slid {
  GridSpec grid{7, 9, {0.06, 0.08}};
  Surroundings surroundings;
  Cloth cloth{grid, laws(), MassRule::area};
  Field position;

  Slid() { surroundings.add(Table{0.0}); }

  static ClothLaws laws() {
    ClothLaws laws;
    laws.density_kg_per_m2 = 0.15;
    for (int k = 0; k < 2; ++k) {
      laws.tensile[k].slope = 1000;
      laws.bending[k].slope = 5e-6;
    }
    return laws;
  }
  StaticContacts contacts() {
    position.assign(3 * static_cast<std::size_t>(grid.count()), 0.0);
    for (int r = 0; r < grid.rows; ++r) {
      for (int c = 0; c < grid.cols; ++c) {
        move_by(position, grid.index(r, c),
                {r * grid.warp_spacing_m(), c * grid.weft_spacing_m(), -kSunk_m});
      }
    }
    StaticContacts contacts(cloth, surroundings, 0.4, 9.81, false);
    contacts.begin(position, 1e-3);
    for (int i = 0; i < grid.count(); ++i) move_by(position, i, {3e-3, -1e-3 * (i % 5), 0});
    contacts.begin(position, 1e-3);
    return contacts;
  }
  [[nodiscard]] VectorXd forces_of(const StaticContacts& contacts) const {
    Field force(position.size(), 0.0);
    contacts.add_forces(position, force);
    VectorXd all(position.size());
    const int n = grid.count();
    for (int i = 0; i < n; ++i)
      all.segment<3>(3 * i) = Vector3d(force[i], force[n + i], force[2 * n + i]);
    return all;
  }
};

/// Presses some particles harder and others less, none of them off.
VectorXd displacement_of(int count) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  VectorXd displacement(3 * count);
  for (int i = 0; i < count; ++i) {
    displacement.segment<3>(3 * i) =
        Vector3d(1e-4 * any(random), 1e-4 * any(random), 0.5 * kSunk_m * any(random));
  }
  return displacement;
}

TEST(StaticFriction, ChangesForcesByWhatItAddsToTheGradient) {
  Slid sheet;
  StaticContacts contacts = sheet.contacts();
  ASSERT_EQ(contacts.sliding(), sheet.grid.count());
  const VectorXd before = sheet.forces_of(contacts);
  VectorXd change = VectorXd::Zero(before.size());
  contacts.follow_pressing(sheet.position, displacement_of(sheet.grid.count()), change);
  const VectorXd after = sheet.forces_of(contacts);
  EXPECT_GT(change.norm(), 0.05 * before.norm());
  EXPECT_LT((after - before + change).norm(), 1e-9 * change.norm());
}

TEST(StaticFriction, HasALinearModelOfHowItFollows) {
  Slid sheet;
  StaticContacts contacts = sheet.contacts();
  const VectorXd displacement = displacement_of(sheet.grid.count());
  VectorXd change = VectorXd::Zero(displacement.size());
  VectorXd model = change;
  contacts.add_lag(model);
  contacts.add_following(displacement, model);
  contacts.follow_pressing(sheet.position, displacement, change);
  EXPECT_GT(change.norm(), 0);
  EXPECT_LT((model - change).norm(), 1e-9 * change.norm());
}

TEST(StaticFriction, KeepsToCoulombsLawWhereTheStepEnds) {
  Slid sheet;
  StaticContacts contacts = sheet.contacts();
  const VectorXd displacement = displacement_of(sheet.grid.count());
  VectorXd change = VectorXd::Zero(displacement.size());
  contacts.follow_pressing(sheet.position, displacement, change);
  for (int i = 0; i < sheet.grid.count(); ++i)
    move_by(sheet.position, i, displacement.segment<3>(3 * i));
  const VectorXd end = sheet.forces_of(contacts);
  for (int i = 0; i < sheet.grid.count(); ++i) {
    const double pressing = end[3 * i + 2];
    const double friction = end.segment<2>(3 * i).norm();
    EXPECT_GT(pressing, 0);
    EXPECT_NEAR(friction, 0.4 * pressing, 1e-6 * pressing) << "particle " << i;
  }
}

}  // namespace
}  // namespace drape::simulate

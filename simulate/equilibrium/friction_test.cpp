// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "core/units.hpp"
#include "simulate/equilibrium/contacts.hpp"
#include "simulate/equilibrium/solver.hpp"
#include "simulate/validation/test_exact.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using units::mm;

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

/// A flat cell, pressed against the rounded edge of a box, slides across it.
TEST(StaticFriction, IsKeptWherePlacesAreFoundAgain) {
  constexpr double kRadius = 5 * mm, kDepth = 20e-6, kSlide = 0.1 * mm, kSide = 10 * mm;
  const Vector3d out = Vector3d(1, 0, 1).normalized(), along = Vector3d(1, 0, -1).normalized();
  Surroundings around;
  Box box;
  box.size_m.setConstant(100 * mm);
  box.edge_radius_m = kRadius;
  around.add(box);
  const GridSpec grid{2, 2, {kSide, kSide}};
  const Cloth cloth(grid, Slid::laws(), MassRule::area);
  Field position(3 * static_cast<std::size_t>(grid.count()), 0.0);
  const Vector3d middle = Vector3d(45, 0, 45) * mm + (kRadius - kDepth) * out;
  for (int r = 0; r < 2; ++r) {
    for (int c = 0; c < 2; ++c)
      move_by(position, grid.index(r, c),
              middle + (r - 0.5) * kSide * along + (c - 0.5) * kSide * Vector3d::UnitY());
  }
  StaticContacts contacts(cloth, around, 0.4, 9.81, true);
  const auto of_lines = [&] {  // total, along the slope and across it
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const ContactForce& contact : contacts.forces(position)) {
      if (contact.weight[2] == 0 && contact.weight[3] == 0)
        sum += Eigen::Vector2d(contact.force_in_world.dot(along), contact.force_in_world.dot(out));
    }
    return sum;
  };
  contacts.refresh(position);
  contacts.begin(position, kSide);
  for (int i = 0; i < grid.count(); ++i) move_by(position, i, kSlide * along);
  contacts.begin(position, kSide);
  const Eigen::Vector2d before = of_lines();
  contacts.refresh(position);
  contacts.begin(position, kSide);
  const Eigen::Vector2d after = of_lines();
  EXPECT_GT(after.y(), 1.01 * before.y());  // else no place moved
  EXPECT_LT(before.x(), -0.3 * before.y());
  EXPECT_NEAR(after.x(), before.x(), 2 * kSlide / kRadius * before.y());  // the normal turns
}

/// A strip over a cylinder whose longer end weighs 2 % less than friction bears over half a turn,
/// or more: Euler's and Eytelwein's belt with its own weight. What holds may move by what chords
/// are shorter than the arc, 0.06 mm, and by the stretch of friction's springs.
TEST(StaticFriction, AStripOverACylinderHoldsAsTheCapstanSays) {
  constexpr double kRadius = 20 * mm, kMu = 0.3, kShort = 50 * mm, kSpacing = 3 * mm, kG = 9.80665;
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.3;
  laws.tensile[0].slope = laws.tensile[1].slope = 2000;
  laws.shear.slope = 100;
  laws.bending[0].slope = laws.bending[1].slope = laws.twist_n_m = 1e-7;
  const double weight = laws.density_kg_per_m2 * kG, arc = std::numbers::pi * kRadius;
  const double balanced = exact::capstan_tension(weight * kShort, kMu, weight, kRadius) / weight;
  Cylinder roller;
  roller.radius_m = kRadius;
  roller.height_m = 100 * mm;
  roller.edge_radius_m = 1 * mm;
  roller.world_from_cylinder.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY()).toRotationMatrix();
  Surroundings around;
  around.add(roller);
  for (const double more : {-0.02, 0.02}) {
    const double length = kShort + arc + (1 + more) * balanced;
    const int rows = 1 + static_cast<int>(std::lround(length / kSpacing));
    const GridSpec grid{rows, 3, {length, 2 * kSpacing}};
    Cloth cloth(grid, laws, MassRule::area);
    StaticOptions options;
    options.friction = kMu;
    options.falls = Falls::first;
    options.longest_fall_s = 0.5;
    options.max_iterations = 30;
    StaticSolver sheet(cloth, around, options);
    sheet.position.assign(3 * static_cast<std::size_t>(grid.count()), 0.0);
    for (int r = 0; r < rows; ++r) {
      const double s = length * r / (rows - 1) - kShort;
      const double angle = std::clamp(s / kRadius, 0.0, std::numbers::pi);
      const double below = std::min(s, 0.0) - std::max(s - arc, 0.0);
      for (int c = 0; c < 3; ++c)
        move_by(
            sheet.position, grid.index(r, c),
            {-kRadius * std::cos(angle), (c - 1) * kSpacing, kRadius * std::sin(angle) + below});
    }
    const Field start = sheet.position;
    const StaticReport report = sheet.solve();
    const int end = 2 * grid.count() + grid.index(rows - 1, 1);
    const double sunk = start[end] - sheet.position[end];
    if (more < 0) {
      EXPECT_EQ(report.status, StaticStatus::at_rest);
      EXPECT_LT(std::abs(sunk), 0.1 * mm);
    } else {
      EXPECT_NE(report.status, StaticStatus::at_rest);
      EXPECT_GT(sunk, 10 * mm);
    }
  }
}

}  // namespace
}  // namespace drape::simulate

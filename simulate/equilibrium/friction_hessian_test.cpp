// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstring>
#include <random>

#include "simulate/equilibrium/hessian.hpp"

namespace drape::simulate {
namespace {

ClothLaws friction_laws() {
  ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  laws.tensile[0] = {1500, {}};
  laws.tensile[1] = {900, {}};
  laws.shear = {40, {}};
  laws.bending[0] = {8e-6, {}};
  laws.bending[1] = {5e-6, {}};
  laws.twist_n_m = 9e-6;
  laws.friction =
      ClothFriction{{{{{4e-5, 4e-4, 0}, {1e-5, 3e-4, 0}}}, {{{2e-5, 2e-4, 0}}}}, {{{100, 0.5, 5}}}};
  return laws;
}

Field wavy(const GridSpec& grid, double noise, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> shake(-noise, noise);
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    const double u = int{i / grid.cols} * grid.warp_spacing_m(),
                 v = i % grid.cols * grid.weft_spacing_m();
    put_at(x, i,
           Eigen::Vector3d(0.05 * std::sin(u / 0.05) + 0.1 * v + shake(random),
                           1.01 * v + shake(random),
                           0.05 * std::cos(u / 0.05) + 0.02 * std::sin(v / 0.02) + shake(random)));
  }
  return x;
}

double potential(const Cloth& cloth, const Field& x) {
  return cloth.energies(x).sum_j();
}

/// Forces are minus the slope of the step's energy, and the Hessian minus that of the forces, also
/// after elements have slipped to and back.
TEST(FrictionHessian, IsTheDerivativeOfTheForcesAndTheyOfTheEnergy) {
  for (const bool round : {false, true}) {
    const GridSpec grid{9, 8, {0.09, 0.08}, round};
    Cloth cloth(grid, friction_laws(), MassRule::area);
    const Field flat = wavy(grid, 0, 1);
    cloth.settle(wavy(grid, 1e-4, 2));
    cloth.settle(flat);
    EXPECT_GT(cloth.dissipated_j(), 0);
    const Field x = wavy(grid, 3e-4, 3);
    GridMatrix hessian(grid);
    hessian.set_zero();
    add_hessian(cloth, x, false, hessian);
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> any(-1, 1);
    const int n = grid.count();
    Field displacement(3 * static_cast<std::size_t>(n));
    for (double& w : displacement) w = any(random);
    const double h = 1e-9;
    Field before = x, after = x, force(x.size(), 0.0), fb = force, fa = force;
    for (std::size_t k = 0; k < x.size(); ++k) {
      before[k] -= h * displacement[k];
      after[k] += h * displacement[k];
    }
    cloth.add_forces(x, nullptr, force);
    cloth.add_forces(before, nullptr, fb);
    cloth.add_forces(after, nullptr, fa);
    double slope = 0;
    for (std::size_t k = 0; k < x.size(); ++k) slope -= force[k] * displacement[k];
    EXPECT_NEAR((potential(cloth, after) - potential(cloth, before)) / (2 * h), slope,
                1e-4 * std::abs(slope));
    Eigen::VectorXd step(3 * n), product(3 * n);
    for (int i = 0; i < n; ++i) step.segment<3>(3 * i) = at(displacement, i);
    hessian.multiply(step, product);
    double error = 0, size = 0;
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d found = (at(fb, i) - at(fa, i)) / (2 * h);
      error = std::max(error, (found - product.segment<3>(3 * i)).norm());
      size = std::max(size, found.norm());
    }
    EXPECT_LT(error, 1e-5 * size);
  }
}

/// A sheet that turns as a whole keeps its state: no force of friction changes but in direction.
TEST(FrictionHessian, TurningTheSheetDissipatesNothing) {
  const GridSpec grid{7, 7, {0.07, 0.07}};
  Cloth cloth(grid, friction_laws(), MassRule::area);
  const Field x = wavy(grid, 2e-4, 5);
  cloth.settle(x);
  const double energy = cloth.energies(x).sum_j();
  const double taken = cloth.dissipated_j();
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Field turned(x.size());
  for (int i = 0; i < grid.count(); ++i) put_at(turned, i, Eigen::Vector3d(turn * at(x, i)));
  EXPECT_NEAR(cloth.energies(turned).sum_j(), energy, 1e-12 * energy);
  cloth.settle(turned);
  EXPECT_NEAR(cloth.dissipated_j(), taken, 1e-12 * taken);
  Field force(x.size(), 0.0), other(x.size(), 0.0);
  cloth.add_forces(x, nullptr, force);
  cloth.add_forces(turned, nullptr, other);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  double size = 0;
  for (int i = 0; i < grid.count(); ++i) {
    EXPECT_LT((turn * at(force, i) - at(other, i)).norm(), 1e-9);
    sum += at(force, i);
    moment += at(x, i).cross(at(force, i));
    size += at(force, i).norm();
  }
  EXPECT_LT(sum.norm(), 1e-12 * size);
  EXPECT_LT(moment.norm(), 1e-12 * size);
}

/// Elements that slip at once add nothing: the same bytes as without any.
TEST(FrictionHessian, NoFrictionIsTheSameBytes) {
  const GridSpec grid{9, 8, {0.09, 0.08}};
  ClothLaws without = friction_laws();
  without.friction.reset();
  ClothLaws empty = without;
  empty.friction = ClothFriction{};
  Cloth a(grid, without, MassRule::area), b(grid, empty, MassRule::area);
  const Field x = wavy(grid, 3e-4, 6);
  Field fa(x.size(), 0.0), fb = fa;
  a.add_forces(x, nullptr, fa);
  b.add_forces(x, nullptr, fb);
  b.settle(x);
  EXPECT_EQ(std::memcmp(fa.data(), fb.data(), fa.size() * sizeof(double)), 0);
  EXPECT_EQ(a.energies(x).sum_j(), b.energies(x).sum_j());
  EXPECT_EQ(a.settle(x), 0);
}

}  // namespace
}  // namespace drape::simulate

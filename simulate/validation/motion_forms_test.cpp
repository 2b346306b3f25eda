// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "simulate/dynamics/motion.hpp"
#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

/// Undamped motion of a wavy, falling sheet: what Runge-Kutta loses of the energy, over the elastic
/// energy at the start; negative for a gain.
double lost_energy(double fraction_of_limit) {
  const GridSpec grid{9, 9, {0.08, 0.08}};
  Cloth cloth(grid, linear_laws(0.138, 2000, 30, 7.7e-6), MassRule::area);
  const Surroundings nothing;
  Motion motion(cloth, nothing, {{0, 0, -kGravity}, 0, 0, 0, false});
  motion.position = shaped(grid, [](double u, double v) {
    return Vector3d(1.002 * u, v, 0.002 * std::sin(70 * u + 40 * v));
  });
  const auto energy = [&] {
    return motion.kinetic_energy_j() + motion.gravity_energy_j() +
           cloth.energies(motion.position).sum_j();
  };
  const double scale = cloth.energies(motion.position).sum_j();
  const double start = energy();
  const double step = fraction_of_limit * motion.stable_step_s(1.0);
  const int steps = static_cast<int>(std::lround(100 / fraction_of_limit));
  for (int k = 0; k < steps; ++k) motion.step(step);
  return (start - energy()) / scale;
}

TEST(Motion, KeepsItsEnergyWithoutDamping) {
  const double coarse = lost_energy(0.2), fine = lost_energy(0.1);
  expect_at_most("energy lost without damping at a tenth of the step limit", std::abs(fine), 1e-3);
  expect_at_least("order of that loss in the step", std::log2(coarse / fine), 4.5);
}

/// Displacement of a small sheet lying on a slope after a time, started at rest.
double slid(double slope_rad, double mu, double time_s) {
  const GridSpec grid{3, 3, {0.02, 0.02}};
  Cloth cloth(grid, linear_laws(0.3, 3000, 300, 1e-6), MassRule::area);
  Surroundings ground;
  ground.add(Table{0});
  const Vector3d gravity = kGravity * Vector3d(std::sin(slope_rad), 0, -std::cos(slope_rad));
  Motion motion(cloth, ground, {gravity, 0, 0, mu, true});
  motion.position = shaped(grid, [](double u, double v) { return Vector3d(u, v, 1e-9); });
  const double step = 0.5 * motion.stable_step_s(1.0);
  const int steps = static_cast<int>(std::ceil(time_s / step));
  for (int k = 0; k < steps; ++k) motion.step(time_s / steps);
  return at(motion.position, 4).x() - 0.01;
}

TEST(Motion, OfASheetOnASlopeIsCoulombs) {
  const double mu = 0.4;
  double low = 0;
  double high = 0.5 * std::numbers::pi;
  for (int i = 0; i < 14; ++i) {
    const double middle = 0.5 * (low + high);
    (slid(middle, mu, 0.02) > 1e-6 ? high : low) = middle;
  }
  expect_relative("slope at which a sheet starts to slide, tangent over mu", mu, std::tan(high),
                  1e-2);
  const double slope = 0.6;
  const double distance = 0.5 * kGravity * (std::sin(slope) - mu * std::cos(slope)) * 0.1 * 0.1;
  expect_relative("distance slid down a slope in 0.1 s (m)", distance, slid(slope, mu, 0.1), 1e-2);
}

/// Mean tension of row r -> r + 1 (N/m).
double tension(const Cloth& cloth, const Field& x, int r) {
  const GridSpec& grid = cloth.grid();
  const double length = (at(x, grid.index(r + 1, 0)) - at(x, grid.index(r, 0))).norm();
  return cloth.laws().tensile[0].value(length / grid.warp_spacing_m() - 1);
}

/// Height of the middle of row r -> r + 1 (m).
double middle_z(const Cloth& cloth, const Field& x, int r) {
  return 0.5 * (at(x, cloth.grid().index(r, 0)).z() + at(x, cloth.grid().index(r + 1, 0)).z());
}

/// A belt over a horizontal cylinder, its right end pulled down slowly: ratio of the tensions.
TEST(Motion, OfABeltOverACylinderIsTheCapstans) {
  const double radius = 0.02;
  const double mu = 0.3;
  const double density = 0.3;
  const double tail = 0.1;
  const int arc_cells = 60;
  const double h = std::numbers::pi * radius / arc_cells;
  const int tail_cells = static_cast<int>(std::ceil(tail / h));
  const int rows = arc_cells + 2 * tail_cells + 1;
  const GridSpec grid{rows, 2, {h * (rows - 1), 0.01}};
  ClothLaws laws = linear_laws(density, 2000, 30, 1e-9);
  laws.stretch_damping_s = 1e-6;
  Cloth cloth(grid, laws, MassRule::area);
  Surroundings roller;
  Cylinder body{{}, radius, 0.2, 0};
  body.world_from_cylinder.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY()).toRotationMatrix();
  roller.add(body);
  Motion motion(cloth, roller, {{0, 0, -kGravity}, 20, 0, mu, false});
  motion.position = shaped(grid, [&](double u, double v) {
    const double s = u - tail_cells * h;
    const double arc = std::numbers::pi * radius;
    if (s < 0) return Vector3d(-radius, v, s);
    if (s > arc) return Vector3d(radius, v, arc - s);
    // Particles on the circle just outside the chords' sag.
    return Vector3d(-radius * std::cos(s / radius), v, radius * std::sin(s / radius));
  });
  motion.hold(
      {{{grid.count() - 2, 0, 0, 0}, {1, 0, 0, 0}}, {{grid.count() - 1, 0, 0, 0}, {1, 0, 0, 0}}});
  Eigen::Matrix3Xd rate = Eigen::Matrix3Xd::Zero(3, 2);
  rate.row(2).setConstant(-0.005);
  motion.move_holds(rate);
  const double step = motion.stable_step_s(0.8);
  double sum = 0;
  double closed = 0;
  const int steps = static_cast<int>(1.0 / step);
  for (int k = 0; k < steps; ++k) {
    motion.step(step);
    if (k < steps / 2) continue;
    // Tensions where the belt meets and leaves the cylinder, by the weight from there on.
    int first = 0;
    int last = rows - 2;
    while (at(motion.position, grid.index(first + 1, 0)).z() < 0) ++first;
    while (at(motion.position, grid.index(last, 0)).z() < 0) --last;
    // Springs carry the tension of their middles, a little below or above that height.
    const double slack = tension(cloth, motion.position, first) -
                         density * kGravity * middle_z(cloth, motion.position, first);
    sum += tension(cloth, motion.position, last) -
           density * kGravity * middle_z(cloth, motion.position, last);
    closed += exact::capstan_tension(slack, mu, density * kGravity, radius);
  }
  expect_relative("belt over a cylinder: pulling tension over the closed form", 1, sum / closed,
                  1e-2);
}

}  // namespace
}  // namespace drape::simulate

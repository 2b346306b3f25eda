// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
constexpr double kSewnDensity = 0.138;

/// Positions along a planar curve of given angle (from +x towards +z) over the arc, both columns
/// of a strip alike; `shift` of a cell before the origin.
template <class Angle>
Field along(const GridSpec& grid, double shift, Angle angle) {
  const double h = grid.warp_spacing_m();
  Field x(3 * static_cast<std::size_t>(grid.count()));
  Vector3d p = Vector3d(std::cos(angle(-1.0)), 0, std::sin(angle(-1.0))) * (-shift * h);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.cols; ++c) {
      put_at(x, grid.index(r, c), p + Vector3d(0, c * grid.weft_spacing_m(), 0));
    }
    const double turn = angle((r + 0.5 - shift) / (grid.rows - 1 - 2 * shift));
    p += h * Vector3d(std::cos(turn), 0, std::sin(turn));
  }
  return x;
}

/// Both ends clamped upright in one place, half a cell before the second rows' hinges.
TEST(Loop, HangsAsTheHeartLoop) {
  const double length = 0.12;
  const int rows = 161;
  const double h = length / (rows - 2);
  const GridSpec grid{rows, 2, {h * (rows - 1), h}};
  for (const double gamma : {0.0, 24.0, 100.0, 390.0}) {
    const double density = gamma * kBending / (kGravity * std::pow(length, 3));
    Cloth cloth(
        grid, linear_laws(std::max(density, 1e-9), 1e7 * kBending / (length * length), 1, kBending),
        MassRule::area);
    // From up (90 degrees) over the right shoulder to the lowest point and up the left one.
    Field x = along(grid, 0.5, [](double s) {
      if (s <= 0) return 0.5 * kPi;
      if (s >= 1) return -2.5 * kPi;
      return 0.5 * kPi - 3 * kPi * s - 0.67 * std::sin(2 * kPi * s);
    });
    // The ends go where the clamp is; the rest follows by itself.
    for (const int row : {0, 1, rows - 2, rows - 1}) {
      const double above = (row == 0 || row == rows - 1) ? -0.5 * h : 0.5 * h;
      for (int c = 0; c < 2; ++c) put_at(x, grid.index(row, c), {0, c * h, above});
    }
    Equilibrium balance(cloth, weight(cloth, {0, 0, gamma > 0 ? -kGravity : 0.0}),
                        held_rows(grid, {0, 1, rows - 2, rows - 1}),
                        kBending * h / (length * length));
    const bool found = balance.find(x, h).found;
    // The lowest point is the middle of the arc, on a particle.
    const double height = found ? -at(x, grid.index(rows / 2, 0)).z() / length : 0;
    expect_relative(fmt::format("heart loop height over length, Gamma {:g}", gamma),
                    exact::heart_loop_height(gamma), height, 2e-3);
  }
}

/// A pinned strut pushed to a given chord; the load is the force on its held end.
TEST(Strut, BearsTheLoadOfTheElastica) {
  const double length = 0.1;
  const int rows = 81;
  const GridSpec grid{rows, 2, {length, 0.002}};
  Cloth cloth(grid, linear_laws(kSewnDensity, 1e8 * kBending / (length * length), 1, kBending),
              MassRule::area);
  for (const double degrees : {20.0, 60.0, 100.0}) {
    const double alpha = degrees * kPi / 180;
    const exact::Elastica strut = exact::elastica(alpha);
    Field x = along(grid, 0, [alpha](double s) { return alpha * std::cos(kPi * s); });
    const double chord = strut.chord * length;
    const double stretch = chord / at(x, grid.index(rows - 1, 0)).x();
    for (int i = 0; i < grid.count(); ++i) {
      const Vector3d p = at(x, i);
      const int r = i / 2;
      put_at(x, i,
             {p.x() * stretch, p.y(), p.z() - 1.0 * r / (rows - 1) * at(x, grid.count() - 1).z()});
    }
    Equilibrium balance(cloth, weight(cloth, {0, 0, 0}), held_rows(grid, {0, rows - 1}),
                        kBending * 0.002 / (length * length));
    (void)balance.find(x, 0.5 * grid.warp_spacing_m());
    Field force(x.size(), 0.0);
    cloth.add_forces(x, nullptr, force);
    const double push = -(force[0] + force[1]) / 0.002;
    const double euler = kPi * kPi * kBending / (length * length);
    expect_relative(fmt::format("strut load over Euler's, end slope {:g} deg", degrees), strut.load,
                    push / euler, 2e-3);
  }
}

TEST(Chain, SagsAsTheCatenary) {
  const double length = 0.2;
  const int rows = 81;
  const GridSpec grid{rows, 2, {length, 0.004}};
  Cloth cloth(grid, linear_laws(0.3, 1e6 * 0.3 * kGravity * length, 1, 1e-13), MassRule::area);
  for (const double chord : {0.5, 0.775, 0.95}) {
    const double sag = exact::catenary_sag(chord);
    // A parabola of about the right sag; its arc need not fit.
    Field x = shaped(grid, [&](double u, double v) {
      const double t = 2 * u / length - 1;
      return Vector3d(0.5 * chord * length * t, v, sag * length * (t * t - 1));
    });
    Equilibrium balance(cloth, weight(cloth, {0, 0, -kGravity}), held_rows(grid, {0, rows - 1}));
    const bool found = balance.find(x, grid.warp_spacing_m()).found;
    const double low = found ? -at(x, grid.index(rows / 2, 0)).z() / length : 0;
    expect_relative(fmt::format("catenary sag over length, chord {:g}", chord), sag, low, 1e-3);
  }
}

}  // namespace
}  // namespace drape::simulate

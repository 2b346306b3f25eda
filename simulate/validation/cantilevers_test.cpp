// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/validation/test_exact.hpp"
#include "simulate/validation/test_sheets.hpp"

namespace drape::simulate {
namespace {

constexpr double kStride = 0.5 * kLength / 40;  // step of a coordinate in an iteration

/// Tensile modulus over weight of the strip per width. On fine grids a stiffer strip's forces are
/// rounded by more than they are to balance.
double stretch_per_load(int rows) {
  return rows > 100 ? 4e4 : 1e5;
}

/// Tip of a strip clamped horizontally: two rows held, the clamp line half a cell before the
/// second one, because that row's hinge stands for half a cell on each side of it.
class Cantilever {
 public:
  Cantilever(int rows, double gamma)
      : spacing_(kLength / (rows - 1.5)),
        grid_{rows, 2, {spacing_ * (rows - 1), spacing_}},
        density_(gamma * kBending / (kGravity * std::pow(kLength, 3))),
        cloth_(grid_,
               linear_laws(density_, stretch_per_load(rows) * density_ * kGravity * kLength, 1,
                           kBending),
               MassRule::area) {}

  /// Starts from `x` when it has the right size, else from the straight strip.
  bool solve(Field& x) {
    if (x.size() != 3 * static_cast<std::size_t>(grid_.count())) {
      x = shaped(grid_, [](double u, double v) { return Eigen::Vector3d(u, v, 0); });
    }
    // Weight of a particle of 41 rows, whatever the grid.
    const double scale_n = density_ * kGravity * kLength * spacing_ / 80;
    Equilibrium balance(cloth_, weight(cloth_, {0, 0, -kGravity}), held_rows(grid_, {0, 1}),
                        scale_n);
    const Equilibrium::Outcome outcome = balance.find(x, kStride);
    const Eigen::Vector3d tip = at(x, grid_.index(grid_.rows - 1, 0));
    const Eigen::Vector3d before = at(x, grid_.index(grid_.rows - 2, 0));
    width = (tip.x() - 0.5 * spacing_) / kLength;
    height = -tip.z() / kLength;
    tip_rad = std::atan2(before.z() - tip.z(), tip.x() - before.x());
    return outcome.found;
  }

  [[nodiscard]] const GridSpec& grid() const { return grid_; }
  double width = 0, height = 0, tip_rad = 0;

 private:
  double spacing_;
  GridSpec grid_;
  double density_;
  Cloth cloth_;
};

/// Relative error of H / W.
double ratio_error(int rows, double gamma) {
  Field x;
  Cantilever strip(rows, gamma);
  (void)strip.solve(x);
  const exact::Cantilever shape = exact::cantilever(gamma);
  return strip.height / strip.width / (shape.height / shape.width) - 1;
}

/// The clamp's bend is (B / rho g)^(1/3) long: 52 cells of it leave half of the goal.
int rows_for(double gamma) {
  constexpr double kCells = 52;
  return std::max(41, 2 + static_cast<int>(std::ceil(kCells * std::cbrt(gamma))));
}

/// The shape of a strip on one with other rows; what is held stands in its place.
Field resampled(const Field& x, const GridSpec& grid) {
  const int before = static_cast<int>(x.size() / 6);
  Field finer(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i) {
    const int along = i / 2;
    const double place = static_cast<double>(along) * (before - 1) / (grid.rows - 1);
    const int row = std::min(static_cast<int>(place), before - 2);
    const double t = place - row;
    Eigen::Vector3d p = (1 - t) * at(x, 2 * row + i % 2) + t * at(x, 2 * row + 2 + i % 2);
    p.y() = (i % 2) * grid.weft_spacing_m();
    if (i < 4) p.x() = along * grid.warp_spacing_m();
    put_at(finer, i, p);
  }
  return finer;
}

TEST(Cantilever, LiesOnTheMasterCurve) {
  Field x;  // one shape leads to the next
  for (int k = -4; k <= 8; ++k) {
    const double gamma = std::pow(10.0, 0.5 * k);
    const exact::Cantilever shape = exact::cantilever(gamma);
    Cantilever strip(rows_for(gamma), gamma);
    if (!x.empty()) x = resampled(x, strip.grid());
    const bool found = strip.solve(x);
    const double ratio = found ? strip.height / strip.width : 0.0;
    expect_relative(fmt::format("cantilever H/W, Gamma {:.4g}", gamma), shape.height / shape.width,
                    ratio, 1e-3);
    if (k % 4 == 0) {
      expect_relative(fmt::format("cantilever tip angle (rad), Gamma {:.4g}", gamma), shape.tip_rad,
                      found ? strip.tip_rad : 0.0, 5e-2);
    }
  }
  // From 21 and 41 particles, the error of order two taken out (Richardson).
  double ratio[2] = {0, 0};
  const int rows[2] = {21, 41};
  for (int k = 0; k < 2; ++k) {
    Field own;
    Cantilever strip(rows[k], 100);
    if (strip.solve(own)) ratio[k] = strip.height / strip.width;
  }
  const exact::Cantilever shape = exact::cantilever(100);
  expect_relative("cantilever H/W, Gamma 100, 21 and 41", shape.height / shape.width,
                  ratio[1] + (ratio[1] - ratio[0]) / (std::pow(39.5 / 19.5, 2) - 1), 1e-3);
  // At Gamma 10 the leading error changes sign, so the order is read off below and above it.
  for (const double gamma : {1.0, 100.0}) {
    const double coarse = ratio_error(41, gamma);
    const double fine = ratio_error(81, gamma);
    const double order = std::log(std::abs(coarse / fine)) / std::log(79.5 / 39.5);
    expect_at_least(fmt::format("order of the H/W error, Gamma {:g}", gamma), order, 1.9);
  }
}

/// Finds the strip whose chord hangs at 41.5 degrees and reads B from the exact Gamma.
TEST(Cantilever, OfPeirceGivesBackTheStiffness) {
  const double chord = 41.5 * std::numbers::pi / 180;
  const exact::Cantilever shape = exact::cantilever_at_chord_angle(chord);
  double low = 5;
  double high = 12;
  Field x;
  for (int i = 0; i < 25; ++i) {
    const double gamma = 0.5 * (low + high);
    Cantilever strip(41, gamma);
    (void)strip.solve(x);
    (strip.height / strip.width < std::tan(chord) ? low : high) = gamma;
  }
  // The strip was made with B; the operator would compute rho g L^3 / Gamma_exact.
  expect_relative("B from Peirce's 41.5 degrees, over the B put in", 1, low / shape.gamma, 5e-3);
}

}  // namespace
}  // namespace drape::simulate

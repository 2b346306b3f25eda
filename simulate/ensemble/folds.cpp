// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/folds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurn = 1.2;    // rad, by which a side hangs down; upright sides would meet
constexpr double kRound = 0.05;  // of the pins' distance in the sheet: the fold's radius
constexpr double kHigh = 0.1;    // of that distance: the height of waves
constexpr double kSteep = 1e-3;  // horizontal part of the pins' direction below which none is seen

/// The line through the pins, in the sheet and in the world.
struct Line {
  Vector2d from_m, along_m, across_m;
  Vector3d from, along, across, down;
  double length_m = 0;
};

/// Whether there is sheet to hang on either side.
bool parts(const Line& line, const Vector2d& patch_m) {
  double least = 0, most = 0;
  for (const Vector2d& part : {Vector2d(0, 0), Vector2d(0, 1), Vector2d(1, 0), Vector2d(1, 1)}) {
    const double d = (part.cwiseProduct(patch_m) - line.from_m).dot(line.across_m);
    least = std::min(least, d);
    most = std::max(most, d);
  }
  return std::min(most, -least) > kRound * line.length_m;
}

/// `halves`: of a wave along the fold between the pins, the sign its side.
void fold(const Line& line, bool left, bool right, int halves, const GridSpec& grid,
          Field& position) {
  const double round_m = kRound * line.length_m;
  for (int i = 0; i < grid.count(); ++i) {
    const Vector2d from_pin = material_of(grid, i / grid.cols, i % grid.cols) - line.from_m;
    const double s = from_pin.dot(line.along_m), d = from_pin.dot(line.across_m);
    const double between = std::clamp(s / line.length_m, 0.0, 1.0);
    const double turn = (d < 0 ? left : right) ? kTurn : 0.0, far = std::abs(d);
    const double bent = std::min(far / round_m, turn), straight = far - round_m * bent;
    const double out = round_m * std::sin(bent) + straight * std::cos(turn);
    const double low = round_m * (1 - std::cos(bent)) + straight * std::sin(turn);
    const double wave = kHigh * line.length_m * std::sin(halves * std::numbers::pi * between);
    put_at(position, i,
           line.from + s * line.along + (std::copysign(out, d) + wave) * line.across +
               low * line.down);
  }
}

}  // namespace

std::vector<StartChange> folded_starts(const StaticCase& the_case) {
  const std::vector<Pin>& pins = the_case.scene.pins;
  if (pins.size() != 2 || !the_case.scene.clamps.empty() || !pins[0].point_in_world ||
      !pins[1].point_in_world)
    return {};
  Line line;
  line.from_m = pins[0].material_m(the_case.print);
  line.from = *pins[0].point_in_world;
  const Vector2d in_sheet = pins[1].material_m(the_case.print) - line.from_m;
  const Vector3d in_world = *pins[1].point_in_world - line.from;
  line.length_m = in_sheet.norm();
  const Vector3d up = -the_case.scene.gravity_m_per_s2.normalized();
  if (!(up.cross(in_world).norm() > kSteep * in_world.norm()) || !(line.length_m > 0)) return {};
  line.along_m = in_sheet / line.length_m;
  line.across_m = {-line.along_m.y(), line.along_m.x()};
  line.along = in_world.normalized();
  line.across = up.cross(line.along).normalized();
  line.down = line.across.cross(line.along);
  if (line.down.dot(up) > 0) line.down = -line.down;
  if (!parts(line, the_case.print.patch_m)) return {};
  line.from += 0.5 * (in_world.norm() - line.length_m) * line.along;
  std::vector<StartChange> starts;
  for (const auto& [left, right] : {std::pair(true, false), {false, true}, {true, true}}) {
    for (const int halves : {0, 1, -1}) {
      if (left && right && halves == 0) continue;  // it balances on its pins and ends higher
      starts.emplace_back(
          [line, l = left, r = right, halves](const GridSpec& grid, Field& position) {
            fold(line, l, r, halves, grid, position);
          });
    }
  }
  return starts;
}

}  // namespace drape::simulate

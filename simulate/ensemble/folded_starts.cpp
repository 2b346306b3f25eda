// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/folded_starts.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurn = 1.2;    // rad; tilt of a hanging side; vertical sides would meet
constexpr double kRound = 0.05;  // radius of the fold, relative to the pins' distance in the cloth
constexpr double kHigh = 0.1;    // height of waves, relative to that distance
constexpr double kSteep = 1e-3;  // least horizontal component of the pins' direction

/// The line through the pins, on the cloth and in space.
struct Line {
  Vector2d from_m, along_m, across_m;
  Vector3d from, along, across, down;
  double length_m = 0;
};

/// True if there is enough cloth to hang on each side.
bool parts(const Line& line, const ClothOutline& outline) {
  double least = 0, most = 0;
  for (const Vector2d& corner : outline.outer) {
    const double d = (corner - line.from_m).dot(line.across_m);
    least = std::min(least, d);
    most = std::max(most, d);
  }
  return std::min(most, -least) > kRound * line.length_m;
}

/// Position of a material point. `halves`: number of half waves along the fold between the pins;
/// its sign selects the side.
Vector3d folded(const Line& line, bool left, bool right, int halves, const Vector2d& material_m) {
  const double round_m = kRound * line.length_m;
  const Vector2d from_pin = material_m - line.from_m;
  const double s = from_pin.dot(line.along_m), d = from_pin.dot(line.across_m);
  const double between = std::clamp(s / line.length_m, 0.0, 1.0);
  const double turn = (d < 0 ? left : right) ? kTurn : 0.0, far = std::abs(d);
  const double bent = std::min(far / round_m, turn), straight = far - round_m * bent;
  const double out = round_m * std::sin(bent) + straight * std::cos(turn);
  const double low = round_m * (1 - std::cos(bent)) + straight * std::sin(turn);
  const double wave = kHigh * line.length_m * std::sin(halves * std::numbers::pi * between);
  return line.from + s * line.along + (std::copysign(out, d) + wave) * line.across +
         low * line.down;
}

}  // namespace

std::vector<DrapeStart> folded_starts(const DrapeCase& drape) {
  const Scene& scene = drape.local.scene;
  if (scene.pins.size() != 2 || !scene.clamps.empty()) return {};
  const std::vector<Vector3d>& pinned = drape.pins_at;
  Line line;
  line.from_m = scene.pins[0].material_m(drape.print);
  line.from = pinned[0];
  const Vector2d in_cloth = scene.pins[1].material_m(drape.print) - line.from_m;
  const Vector3d in_space = pinned[1] - line.from;
  line.length_m = in_cloth.norm();
  const Vector3d up = -scene.gravity_m_per_s2.normalized();
  if (!(up.cross(in_space).norm() > kSteep * in_space.norm()) || !(line.length_m > 0)) return {};
  line.along_m = in_cloth / line.length_m;
  line.across_m = {-line.along_m.y(), line.along_m.x()};
  line.along = in_space.normalized();
  line.across = up.cross(line.along).normalized();
  line.down = line.across.cross(line.along);
  if (line.down.dot(up) > 0) line.down = -line.down;
  if (!parts(line, drape.outline)) return {};
  line.from += 0.5 * (in_space.norm() - line.length_m) * line.along;
  std::vector<DrapeStart> starts;
  for (const auto& [left, right] : {std::pair(true, false), {false, true}, {true, true}})
    for (const int halves : {0, 1, -1}) {
      if (left && right && halves == 0) continue;  // balances on its pins and has higher energy
      starts.emplace_back([line, left = left, right = right, halves](const DrapeLevel& level) {
        const std::vector<Vector2d>& material_m = level.cloth().mesh().points_m;
        std::vector<Vector3d> places;
        places.reserve(material_m.size());
        for (const Vector2d& point : material_m)
          places.push_back(folded(line, left, right, halves, point));
        ClothMoment moment = level.start_at(material_m, places);
        for (const int pin : level.pinned())
          moment.state[pin] = places[pin];  // until the fall moves it
        return moment;
      });
    }
  return starts;
}

}  // namespace drape::simulate

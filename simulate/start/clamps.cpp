// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/clamps.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kSame_m = 1e-6;         // m; what files round to
constexpr double kSameDirection = 1e-3;  // sine; the cloth would leave along the clamp

[[noreturn]] void reject(const Scene& scene, std::size_t k, const std::string& what,
                         const std::string& to_do) {
  throw bad_input(fmt::format("clamp {} {}", k + 1, what),
                  {.file = scene.file.string(), .field = "clamp"}, to_do);
}

/// A clamp on a grid.
struct Line {
  int across = 0;         ///< direction of the threads that leave it: 0 warp, 1 weft
  int row = 0, last = 0;  ///< range of the particles that stand for it; `row` counts along `across`
  double offset_m = 0;    ///< from the line to that row
  Vector3d forward, normal;
};

Line line_of(const Scene& scene, std::size_t k, const GridSpec& grid) {
  const Clamp& clamp = scene.clamps[k];
  const Vector2d along = clamp.to_material_m - clamp.from_material_m;
  for (const Vector2d& end : {clamp.from_material_m, clamp.to_material_m}) {
    if (end.minCoeff() >= -kSame_m && (grid.patch_m - end).minCoeff() >= -kSame_m) continue;
    reject(scene, k,
           fmt::format("ends at ({:g}, {:g}) mm, the patch is {:g} x {:g} mm", end.x() / mm,
                       end.y() / mm, grid.patch_m.x() / mm, grid.patch_m.y() / mm),
           "count along warp and weft from the corner beside mark (0, 0)");
  }
  const Vector3d in_space = clamp.to_in_world - clamp.from_in_world;
  if (!(along.norm() > kSame_m && in_space.norm() > kSame_m))
    reject(scene, k, "has no length", "give two ends apart from each other, or a [[pin]]");
  if (along.cwiseAbs().minCoeff() > kSame_m)
    reject(scene, k, "crosses the threads",
           "a clamp runs along warp or weft: give both ends the same warp or the same weft");
  Line line;
  line.across = std::abs(along[0]) > kSame_m ? 1 : 0;
  const Vector3d tangent = in_space.normalized();
  const Vector3d forward =
      clamp.direction_in_world - clamp.direction_in_world.dot(tangent) * tangent;
  if (!(forward.norm() > kSameDirection))
    reject(scene, k, "is left along itself",
           "give the direction in which the cloth leaves, across the clamp");
  line.forward = forward.normalized();
  line.normal = tangent.cross(line.forward);
  const double spacing_m = line.across == 0 ? grid.warp_spacing_m() : grid.weft_spacing_m();
  line.last = (line.across == 0 ? grid.rows : grid.cols) - 1;
  const double place_m = clamp.from_material_m[line.across];
  line.row = std::clamp(static_cast<int>(std::lround(place_m / spacing_m)), 0, line.last);
  line.offset_m = line.row * spacing_m - place_m;
  if (place_m > grid.patch_m[line.across] - kSame_m) {  // at the far hem the cloth lies before it
    line.forward = -line.forward;
    line.normal = -line.normal;
  }
  return line;
}

void add_line(const Clamp& clamp, const Line& line, const GridSpec& grid, GridClamps& sum) {
  const int d = line.across;
  const double spacing_m = d == 0 ? grid.weft_spacing_m() : grid.warp_spacing_m();
  const int count = d == 0 ? grid.cols : grid.rows;
  const double from_m = clamp.from_material_m[1 - d], to_m = clamp.to_material_m[1 - d];
  const auto on_line = [&](double at_m) { return std::clamp(at_m, 0.0, (count - 1) * spacing_m); };
  const double least_m = on_line(std::min(from_m, to_m)), most_m = on_line(std::max(from_m, to_m));
  int first = static_cast<int>(std::ceil((least_m - kSame_m) / spacing_m));
  int last = static_cast<int>(std::floor((most_m + kSame_m) / spacing_m));
  // On a grid too coarse for the clamp the nearest particle stands for it.
  if (last < first)
    first = last = static_cast<int>(std::lround(0.5 * (least_m + most_m) / spacing_m));
  sum.beside_m = std::max(sum.beside_m, std::abs(line.offset_m));
  sum.ends_m = std::max(
      {sum.ends_m, std::abs(first * spacing_m - least_m), std::abs(last * spacing_m - most_m)});
  for (int k = first; k <= last; ++k) {
    const int i = d == 0 ? grid.index(line.row, k) : grid.index(k, line.row);
    const double part = (k * spacing_m - from_m) / (to_m - from_m);
    const Vector3d place = clamp.from_in_world + part * (clamp.to_in_world - clamp.from_in_world) +
                           line.offset_m * line.forward;
    const auto same = std::find_if(sum.held.begin(), sum.held.end(),
                                   [&](const ClampedParticle& p) { return p.particle == i; });
    if (same == sum.held.end()) {
      sum.held.push_back({i, place});
    } else {
      sum.apart_m = std::max(sum.apart_m, (same->place_in_world - place).norm());
    }
    const int step = d == 0 ? grid.cols : 1;
    const auto leave = [&](int next, const Vector3d& forward) {
      const bool again = std::any_of(sum.places.begin(), sum.places.end(),
                                     [&](const auto& p) { return p.held == i && p.next == next; });
      if (!again) sum.places.push_back({i, next, d, forward, line.normal});
    };
    if (line.row < line.last) leave(i + step, line.forward);
    if (line.row > 0) leave(i - step, -line.forward);
  }
}

}  // namespace

GridClamps clamps_on(const Scene& scene, const GridSpec& grid) {
  GridClamps sum;
  for (std::size_t k = 0; k < scene.clamps.size(); ++k)
    add_line(scene.clamps[k], line_of(scene, k, grid), grid, sum);
  return sum;
}

std::vector<std::string> check_clamps(const Scene& scene, const GridSpec& grid) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < scene.clamps.size(); ++k) {
    const Line line = line_of(scene, k, grid);
    if (std::abs(line.offset_m) > kSame_m) {
      const int spaces = line.last;
      reject(scene, k,
             fmt::format("lies {:.3g} mm beside the nearest row of particles",
                         std::abs(line.offset_m) / mm),
             fmt::format("choose a grid with a row on it: here {} spaces of {:g} mm", spaces,
                         (line.across == 0 ? grid.warp_spacing_m() : grid.weft_spacing_m()) / mm));
    }
    GridClamps alone;
    add_line(scene.clamps[k], line, grid, alone);
    if (alone.held.size() < 2)
      reject(scene, k, "holds fewer than two particles", "choose a finer grid, or give a [[pin]]");
    if (alone.ends_m > kSame_m)
      warnings.push_back(
          fmt::format("clamp {} ends {:.3g} mm beyond the last particle that it holds", k + 1,
                      alone.ends_m / mm));
  }
  if (clamps_on(scene, grid).apart_m > kSame_m)
    throw bad_input("two clamps hold the same point of the cloth in different places",
                    {.file = scene.file.string(), .field = "clamp"},
                    "let their lines meet in space where they meet on the cloth");
  return warnings;
}

}  // namespace drape::simulate

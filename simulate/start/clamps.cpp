// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/clamps.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

constexpr double kSame_m = 1e-6;         // rounding of files
constexpr double kSameDirection = 1e-3;  // sine; the cloth would leave along the clamp
constexpr double kKink = 0.02;           // rad; a visible kink
constexpr double kLook_m = 1e-3;         // step along a clamp in search of gaps in the cloth

[[noreturn]] void reject(const Scene& scene, std::size_t k, const std::string& what,
                         const std::string& to_do) {
  throw bad_input(fmt::format("clamp {} {}", k + 1, what),
                  {.file = scene.file.string(), .field = "clamp"}, to_do);
}

void require_on_cloth(const Scene& scene, std::size_t k, const ClothOutline& outline) {
  const Clamp& clamp = scene.clamps[k];
  const Vector2d along = clamp.to_material_m - clamp.from_material_m;
  const int steps = 1 + static_cast<int>(along.norm() / kLook_m);
  for (int i = 0; i <= steps; ++i) {
    const Vector2d at = clamp.from_material_m + along * i / steps;
    if (is_on(outline, at, kSame_m)) continue;
    reject(scene, k,
           fmt::format("leaves the cloth at warp {:g}, weft {:g} mm", at.x() / mm, at.y() / mm),
           "count along warp and weft from the corner beside mark (0, 0)");
  }
}

/// Direction of the threads that leave a line: 0 for warp, 1 for weft.
int across(const HeldLine& line) {
  return std::abs(line.to_m.x() - line.from_m.x()) > kSame_m ? 1 : 0;
}

HeldLine line_of(const Scene& scene, std::size_t k, const ClothOutline& outline) {
  const Clamp& clamp = scene.clamps[k];
  const Vector2d along = clamp.to_material_m - clamp.from_material_m;
  const Vector3d in_space = clamp.to_in_world - clamp.from_in_world;
  require_on_cloth(scene, k, outline);
  if (!(along.norm() > kSame_m && in_space.norm() > kSame_m))
    reject(scene, k, "has no length", "give two ends apart from each other, or a [[pin]]");
  if (along.cwiseAbs().minCoeff() > kSame_m)
    reject(scene, k, "crosses the threads",
           "a clamp runs along warp or weft: give both ends the same warp or the same weft");
  const Vector3d tangent = in_space.normalized();
  const Vector3d& direction = clamp.direction_in_world;
  const Vector3d forward = direction - direction.dot(tangent) * tangent;
  if (!(forward.norm() > kSameDirection))
    reject(scene, k, "is left along itself",
           "give the direction in which the cloth leaves, across the clamp");
  HeldLine line{
      clamp.from_material_m, clamp.to_material_m, clamp.from_in_world, clamp.to_in_world, {}, {}};
  const int d = across(line);
  Vector2d beside = (line.from_m + line.to_m) / 2;
  beside[d] += 2 * kSame_m;
  Vector3d& leaving = d == 0 ? line.x_u : line.x_v;
  leaving = forward.normalized();
  if (!is_on(outline, beside, kSame_m)) leaving = -leaving;
  (d == 0 ? line.x_v : line.x_u) = in_space / along[1 - d];
  return line;
}

/// Material point shared by two lines, nullopt if they do not meet; for overlapping lines, an end
/// of one.
std::optional<Vector2d> meeting_of(const HeldLine& a, const HeldLine& b) {
  const int d = across(a);
  if (d != across(b)) {
    Vector2d at;
    at[d] = a.from_m[d];
    at[1 - d] = b.from_m[1 - d];
    if (a.holds(at) && b.holds(at)) return at;
    return std::nullopt;
  }
  for (const Vector2d& end : {b.from_m, b.to_m})
    if (a.holds(end)) return end;
  for (const Vector2d& end : {a.from_m, a.to_m})
    if (b.holds(end)) return end;
  return std::nullopt;
}

void require_agreeing(const Scene& scene, const Print& print, const std::vector<HeldLine>& lines) {
  for (std::size_t k = 0; k < lines.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      const std::optional<Vector2d> at = meeting_of(lines[i], lines[k]);
      if (!at) continue;
      const double apart_m = (lines[i].place(*at) - lines[k].place(*at)).norm();
      if (apart_m > kSame_m)
        reject(scene, k,
               fmt::format("and clamp {} hold the same point of the cloth {:.3g} mm apart", i + 1,
                           apart_m / mm),
               "let their lines meet in space where they meet on the cloth");
    }
    for (const Pin& pin : scene.pins) {
      const Vector2d at = pin.material_m(print);
      if (!pin.point_in_world || !lines[k].holds(at)) continue;
      const double apart_m = (lines[k].place(at) - *pin.point_in_world).norm();
      if (apart_m > kSame_m)
        reject(
            scene, k,
            fmt::format("and a pin hold the same point of the cloth {:.3g} mm apart", apart_m / mm),
            "leave the pin out, or give it its place on the clamp");
    }
  }
}

}  // namespace

Vector3d HeldLine::place(const Vector2d& material_m) const {
  const Vector2d along = to_m - from_m;
  return from + (material_m - from_m).dot(along) / along.squaredNorm() * (to - from);
}

bool HeldLine::holds(const Vector2d& material_m) const {
  return distance_m({from_m, to_m}, material_m) <= kSame_m;
}

std::vector<HeldLine> held_lines(const Scene& scene, const Print& print,
                                 const ClothOutline& outline) {
  std::vector<HeldLine> lines;
  for (std::size_t k = 0; k < scene.clamps.size(); ++k) lines.push_back(line_of(scene, k, outline));
  require_agreeing(scene, print, lines);
  return lines;
}

std::vector<std::string> warnings_of_clamps(const std::vector<HeldLine>& lines) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    for (std::size_t i = 0; i < k; ++i) {
      if (!meeting_of(lines[i], lines[k])) continue;
      const auto angle = [&](const Vector3d& a, const Vector3d& b) {
        return std::atan2(a.cross(b).norm(), a.dot(b));
      };
      const double kink =
          std::max(angle(lines[i].x_u, lines[k].x_u), angle(lines[i].x_v, lines[k].x_v));
      if (kink > kKink)
        warnings.push_back(fmt::format(
            "clamps {} and {} meet on the cloth and turn it {:.2g} deg apart: it kinks there",
            i + 1, k + 1, kink / units::deg));
    }
  }
  return warnings;
}

}  // namespace drape::simulate

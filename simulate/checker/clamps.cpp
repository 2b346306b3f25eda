// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/clamps.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate::checker {
namespace {

constexpr Real kOnLine_m = 2e-6L;  // m, in the material: what files round to

Point vector_in(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}

Point unit_of(const Point& v) {
  const Real length = std::sqrt(dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

Point times(const Point& v, Real factor) {
  return {factor * v[0], factor * v[1], factor * v[2]};
}

/// The material line of a clamp: particles are on it where their distance across it is nothing and
/// their part of its length is in 0 .. 1.
struct MaterialLine {
  explicit MaterialLine(const Clamp& clamp)
      : warp(clamp.from_material_m.x()),
        weft(clamp.from_material_m.y()),
        along_warp(Real(clamp.to_material_m.x()) - warp),
        along_weft(Real(clamp.to_material_m.y()) - weft),
        length(std::sqrt(along_warp * along_warp + along_weft * along_weft)) {}

  [[nodiscard]] Real across(Real u, Real v) const {
    return std::abs((u - warp) * along_weft - (v - weft) * along_warp) / length;
  }
  [[nodiscard]] Real part(Real u, Real v) const {
    return ((u - warp) * along_warp + (v - weft) * along_weft) / (length * length);
  }
  [[nodiscard]] bool has(Real u, Real v) const {
    const Real beyond = kOnLine_m / length;
    return across(u, v) < kOnLine_m && part(u, v) > -beyond && part(u, v) < 1 + beyond;
  }

  Real warp, weft, along_warp, along_weft, length;
};

class Holder {
 public:
  Holder(const Sheet& sheet, const std::vector<Point>& points)
      : sheet_(sheet), points_(points), clamped_(points.size(), false) {}

  void hold(const Clamp& clamp, Clamps& sum) {
    const MaterialLine line(clamp);
    const Point from = vector_in(clamp.from_in_world), to = vector_in(clamp.to_in_world);
    const bool has_length = line.length > 0 && dot(minus(to, from), minus(to, from)) > 0;
    const bool on_thread =
        std::min(std::abs(line.along_warp), std::abs(line.along_weft)) < kOnLine_m;
    if (!has_length || !on_thread) {
      sum.refusals.emplace_back("a clamp runs along no thread or has no length");
      return;
    }
    const Point along = unit_of(minus(to, from));
    const Point out = vector_in(clamp.direction_in_world);
    const Point across = minus(out, times(along, dot(out, along)));
    if (!(dot(across, across) > 0)) {
      sum.refusals.emplace_back("a clamp is left along itself");
      return;
    }
    const Point forward = unit_of(across);
    const Point normal = cross(along, forward);
    const int d = std::abs(line.along_warp) < std::abs(line.along_weft) ? 0 : 1;
    int found = 0;
    for (int r = 0; r < sheet_.rows; ++r) {
      for (int c = 0; c < sheet_.cols; ++c) {
        const Real u = Real(sheet_.patch_m.x()) * r / (sheet_.rows - 1);
        const Real v = Real(sheet_.patch_m.y()) * c / (sheet_.cols - 1);
        if (!line.has(u, v)) continue;
        ++found;
        const int i = r * sheet_.cols + c;
        const Point place = minus(from, times(minus(from, to), line.part(u, v)));
        const Point off = minus(points_[i], place);
        sum.farthest_m = std::max(sum.farthest_m, std::sqrt(dot(off, off)));
        if (!clamped_[i]) sum.supports.push_back({{i, i, i, i}, {1, 0, 0, 0}, {}, true});
        clamped_[i] = true;
        const int row = d == 0 ? r : c, last = (d == 0 ? sheet_.rows : sheet_.cols) - 1;
        const int step = d == 0 ? sheet_.cols : 1;
        if (row < last) bend(i, i + step, d, forward, normal, sum);
        if (row > 0) bend(i, i - step, d, row == last ? forward : times(forward, -1), normal, sum);
      }
    }
    if (found < 2)
      sum.refusals.emplace_back("a clamp lies beside the rows of particles of this grid");
  }

 private:
  static void bend(int held, int next, int d, const Point& forward, const Point& normal,
                   Clamps& sum) {
    const bool there =
        std::any_of(sum.halves.begin(), sum.halves.end(),
                    [&](const HalfTriple& half) { return half.held == held && half.next == next; });
    if (!there) sum.halves.push_back({held, next, d, forward, normal});
  }

  const Sheet& sheet_;
  const std::vector<Point>& points_;
  std::vector<bool> clamped_;
};

}  // namespace

Clamps clamps_of(const Scene& scene, const Sheet& sheet, const std::vector<Point>& points) {
  Clamps sum;
  Holder holder(sheet, points);
  for (const Clamp& clamp : scene.clamps) holder.hold(clamp, sum);
  for (const HalfTriple& half : sum.halves) {
    const Point edge = minus(points[half.next], points[half.held]);
    sum.turned_rad = std::max(
        sum.turned_rad, std::atan2(std::abs(dot(edge, half.normal)), dot(edge, half.forward)));
  }
  return sum;
}

}  // namespace drape::simulate::checker

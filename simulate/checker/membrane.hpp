// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/checker/dual.hpp"
#include "simulate/checker/mesh_rest.hpp"

/// Stretch and shear of a triangle mesh, for the checker.
namespace drape::simulate::checker {

using CornerJet = Dual<9>;  // derivatives by the corners of a triangle only
using CornerPlace = Vector<9>;
using MetricJet = Dual<3>;  // derivatives by |x_u|^2, x_u . x_v, |x_v|^2

template <int N>
Dual<N> inverse_root(const Dual<N>& square) {
  const Real size = std::sqrt(square.v);
  return chain(square, 1 / size, -1 / (2 * size * square.v));
}

/// Difference (warp, weft) of the material coordinates of two points.
[[nodiscard]] inline std::array<Real, 2> between(const MeshRest& rest, int from, int to) {
  const Eigen::Vector2d &a = rest.shape.material_m[from], &b = rest.shape.material_m[to];
  return {Real(b.x()) - Real(a.x()), Real(b.y()) - Real(a.y())};
}

/// Metric of a triangle, from its corners.
struct Metric {
  Real area;
  std::array<CornerJet, 3> of;
};
[[nodiscard]] inline Metric metric_of(const MeshRest& rest, int t) {
  const std::array<int, 3>& corner = rest.shape.triangles[t];
  const auto first = between(rest, corner[0], corner[1]),
             second = between(rest, corner[0], corner[2]);
  const Real twice = first[0] * second[1] - first[1] * second[0];
  std::array<CornerPlace, 2> side;  // vectors from the first corner to the others
  for (int k = 0; k < 2; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      CornerJet& at = side[k][axis];
      at.v = Real(rest.shape.points_m[corner[k + 1]][axis]) -
             Real(rest.shape.points_m[corner[0]][axis]);
      at.d[3 * (k + 1) + axis] = 1;
      at.d[axis] = -1;
    }
  CornerPlace x_u, x_v;
  for (int axis = 0; axis < 3; ++axis) {
    x_u[axis] = (1 / twice) * (second[1] * side[0][axis] - first[1] * side[1][axis]);
    x_v[axis] = (1 / twice) * (first[0] * side[1][axis] - second[0] * side[0][axis]);
  }
  return {twice / 2, {dot(x_u, x_u), dot(x_u, x_v), dot(x_v, x_v)}};
}

struct Membrane {
  MetricJet energy, angle;
};
/// Stretch and shear energy per area and shear angle, from a metric.
[[nodiscard]] inline Membrane membrane_of(const ClothLaws& laws,
                                          const std::array<Real, 3>& metric) {
  std::array<MetricJet, 3> m;
  for (int k = 0; k < 3; ++k) {
    m[k].v = metric[k];
    m[k].d[k] = 1;
  }
  MetricJet warp = root(m[0]), weft = root(m[2]);
  warp.v -= 1;
  weft.v -= 1;
  const MetricJet sine = m[1] * inverse_root(m[0] * m[2]);
  const Real s = std::clamp<Real>(sine.v, -1, 1);
  const Real cosine = std::sqrt(std::max<Real>(1e-6L, 1 - s * s));
  const MetricJet angle = chain(sine, std::asin(s), 1 / cosine);
  const MetricJet size = chain(angle, std::abs(angle.v), angle.v < 0 ? -1 : 1);
  return {work_under(laws.tensile[0], warp) + work_under(laws.tensile[1], weft) +
              work_under(laws.shear, size),
          angle};
}

}  // namespace drape::simulate::checker

// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/proximity.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kParallel = 1e-9;  // relative to the product of the squared lengths

/// Parameter, 0 at a and 1 at b, of the point of the segment that is nearest to p.
double fraction_of(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d edge = b - a;
  const double length2 = edge.squaredNorm();
  return length2 > 0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
}

}  // namespace

Nearest point_to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                          const Vector3d& c) {
  const std::array<const Vector3d*, 3> corner{&a, &b, &c};
  std::array<double, 3> weight{};
  const Vector3d u = b - a, v = c - a, w = p - a;
  const Vector3d normal = u.cross(v);
  const double area2 = normal.squaredNorm();
  bool inside = false;
  if (area2 > 0) {
    weight[1] = w.cross(v).dot(normal) / area2;
    weight[2] = u.cross(w).dot(normal) / area2;
    weight[0] = 1 - weight[1] - weight[2];
    inside = weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0;
  }
  if (!inside) {
    double least = 0;
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const double t = fraction_of(p, *corner[k], *corner[next]);
      const double distance2 = (p - *corner[k] - t * (*corner[next] - *corner[k])).squaredNorm();
      if (k > 0 && distance2 >= least) continue;
      least = distance2;
      weight.fill(0);
      weight[k] = 1 - t;
      weight[next] = t;
    }
  }
  return {{1, -weight[0], -weight[1], -weight[2]},
          p - weight[0] * a - weight[1] * b - weight[2] * c};
}

double point_to_edge_m(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  return (a + fraction_of(p, a, b) * (b - a) - p).norm();
}

std::optional<Nearest> point_over_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                                           const Vector3d& c, double slack) {
  const Vector3d u = b - a, v = c - a, w = p - a;
  const Vector3d normal = u.cross(v);
  const double area2 = normal.squaredNorm();
  if (!(area2 > 0)) return std::nullopt;
  const double s = w.cross(v).dot(normal) / area2;
  const double t = u.cross(w).dot(normal) / area2;
  if (s < -slack || t < -slack || 1 - s - t < -slack) return std::nullopt;
  return Nearest{{1, s + t - 1, -s, -t}, w - s * u - t * v};
}

std::optional<Nearest> edge_to_edge(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                                    const Vector3d& d, double slack) {
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double det = uu * vv - uv * uv;
  if (!(det > kParallel * uu * vv)) return std::nullopt;
  const double s = (uv * v.dot(w) - vv * u.dot(w)) / det;
  const double t = (uu * v.dot(w) - uv * u.dot(w)) / det;
  if (s <= -slack || s >= 1 + slack || t <= -slack || t >= 1 + slack) return std::nullopt;
  return Nearest{{1 - s, s, t - 1, -t}, w + s * u - t * v};
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>

#include "simulate/mesh/membrane.hpp"
#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/mesh/normal_curvature.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using State = MeshCloth::State;

/// Derivative of metric_of() along (du, dv).
Vector3d metric_change(const Vector3d& u, const Vector3d& v, const Vector3d& du,
                       const Vector3d& dv) {
  return {2 * u.dot(du), u.dot(dv) + v.dot(du), 2 * v.dot(dv)};
}

/// Derivative of the stress of a metric, elastic and of friction elements with these slips.
Vector3d stress_change(const MetricStrain& strain, const Vector3d& dm, const ClothLaws& laws,
                       double elastic, const double* slip) {
  const double a = strain.a, b = strain.b, s = strain.sine, c = strain.cosine();
  const double angle = strain.angle();
  const double da = dm[0] / (2 * a), db = dm[2] / (2 * b);
  const double ds = dm[1] / (a * b) - s * (da / a + db / b);
  double moment = elastic * laws.shear.odd_value(angle);
  double slope = elastic * laws.shear.tangent(std::abs(angle));
  if (slip != nullptr) {
    moment += laws.friction->shear.force(angle, slip);
    slope += laws.friction->shear.tangent(angle, slip);
  }
  const double by = moment / c, dby = slope * ds / (c * c) + moment * s * ds / (c * c * c);
  const Vector3d of(-s / (2 * a * a), 1 / (a * b), -s / (2 * b * b));
  const Vector3d dof(-ds / (2 * a * a) + s * da / (a * a * a), -(da / a + db / b) / (a * b),
                     -ds / (2 * b * b) + s * db / (b * b * b));
  const auto stretch = [&](const ForceCurve& curve, double size, double change) {
    return elastic *
           (curve.tangent(size - 1) / (2 * size) - curve.value(size - 1) / (2 * size * size)) *
           change;
  };
  return by * dof + dby * of +
         Vector3d(stretch(laws.tensile[0], a, da), 0, stretch(laws.tensile[1], b, db));
}

/// Derivative of the pull of a curve on a curvature vector.
Vector3d bending_change(const ForceCurve& curve, const Vector3d& c, const Vector3d& dc) {
  const double size = c.norm();
  if (!(size > 0)) return curve.slope * dc;
  const double secant = curve.value(size) / size;
  const Vector3d along = c / size;
  return secant * dc + (curve.tangent(size) - secant) * along.dot(dc) * along;
}

/// Derivative of the gradient of normal_curvature() along (dc, da, db).
NormalCurvature curvature_change(const Vector3d& c, const Vector3d& a, const Vector3d& b,
                                 const Vector3d& dc, const Vector3d& da, const Vector3d& db) {
  const Vector3d across = a.cross(b);
  const double size = across.norm();
  const Vector3d n = across / size, dacross = da.cross(b) + a.cross(db);
  const double dsize = n.dot(dacross), value = c.dot(n);
  const Vector3d dn = (dacross - dsize * n) / size;
  const double dvalue = dc.dot(n) + c.dot(dn);
  const Vector3d of = (c - value * n) / size;
  const Vector3d dof = (dc - dvalue * n - value * dn - dsize * of) / size;
  return {dvalue, dn, db.cross(of) + b.cross(dof), dof.cross(a) + of.cross(da)};
}

}  // namespace

void MeshCloth::add_products(const State& state, const State& direction, State& product) const {
  struct Slopes {
    Vector3d u, v, du, dv;
  };
  std::vector<Slopes> slopes;
  std::vector<Vector3d> metric(area_.size(), Vector3d::Zero()), change = metric;
  for (const Triangle& t : triangles_) {
    slopes.push_back({combined(t.d_u, t.unknown, state), combined(t.d_v, t.unknown, state),
                      combined(t.d_u, t.unknown, direction),
                      combined(t.d_v, t.unknown, direction)});
    const auto& [u, v, du, dv] = slopes.back();
    for (const int corner : t.corner) {
      metric[corner] += t.area / 3 * metric_of(u, v);
      change[corner] += t.area / 3 * metric_change(u, v, du, dv);
    }
  }
  std::vector<Vector3d> stress(area_.size()), stress_by(area_.size());
  for (std::size_t i = 0; i < area_.size(); ++i) {
    const MetricStrain strain(metric[i] / area_[i]);
    const double* slip =
        laws_.friction ? memory_.shear.data() + laws_.friction->shear.elements.size() * i : nullptr;
    stress[i] = (1 - in_triangles_) * stress_of(strain, strain.angle(), laws_);
    if (slip != nullptr)
      stress[i] += strain.of_angle(laws_.friction->shear.force(strain.angle(), slip));
    stress_by[i] = stress_change(strain, change[i] / area_[i], laws_, 1 - in_triangles_, slip);
  }
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const auto& [u, v, du, dv] = slopes[i];
    const MetricStrain strain(metric_of(u, v));
    Vector3d pull = in_triangles_ * stress_of(strain, strain.angle(), laws_);
    Vector3d by = stress_change(strain, metric_change(u, v, du, dv), laws_, in_triangles_, nullptr);
    for (const int corner : t.corner) {
      pull += stress[corner] / 3;
      by += stress_by[corner] / 3;
    }
    const Vector3d of_u = t.area * (2 * by[0] * u + by[1] * v + 2 * pull[0] * du + pull[1] * dv);
    const Vector3d of_v = t.area * (by[1] * u + 2 * by[2] * v + pull[1] * du + 2 * pull[2] * dv);
    for (int k = 0; k < 3; ++k) product[t.corner[k]] += t.d_u[k] * of_u + t.d_v[k] * of_v;
    const Vector3d second[2] = {combined(t.d_uu, t.unknown, state),
                                combined(t.d_vv, t.unknown, state)};
    const Vector3d second_by[2] = {combined(t.d_uu, t.unknown, direction),
                                   combined(t.d_vv, t.unknown, direction)};
    const Vector3d twist = t.area * laws_.twist_n_m * combined(t.d_uv, t.unknown, direction);
    for (int k = 0; k < 6; ++k) product[t.unknown[k]] += t.d_uv[k] * twist;
    for (int d = 0; d < 2; ++d) {
      const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
      Vector3d of_second = bending_change(laws_.bending[d], second[d], second_by[d]);
      if (laws_.friction) {
        const FrictionStack& stack = laws_.friction->bending[d];
        const double* slip = memory_.bending[d].data() + stack.elements.size() * i;
        const NormalCurvature own = normal_curvature(second[d], u, v);
        const NormalCurvature other = curvature_change(second[d], u, v, second_by[d], du, dv);
        const double force = stack.force(own.value, slip);
        const double rise = stack.tangent(own.value, slip) * other.value;
        of_second += rise * own.of_c + force * other.of_c;
        const Vector3d of_a = t.area * (rise * own.of_a + force * other.of_a);
        const Vector3d of_b = t.area * (rise * own.of_b + force * other.of_b);
        for (int k = 0; k < 3; ++k) product[t.corner[k]] += t.d_u[k] * of_a + t.d_v[k] * of_b;
      }
      for (int k = 0; k < 6; ++k) product[t.unknown[k]] += t.area * weight[k] * of_second;
    }
  }
  for (const Seam& seam : seams_) {
    const Vector3d jump = seam.stiffness * combined(seam.weight, seam.unknown, direction);
    for (int k = 0; k < 12; ++k) product[seam.unknown[k]] += seam.weight[k] * jump;
  }
}

}  // namespace drape::simulate

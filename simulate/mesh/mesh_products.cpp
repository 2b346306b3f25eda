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

void set(Four& to, const Vector3d& of) {
  to = Four{of.x(), of.y(), of.z(), 0};
}

/// Computes the change of each triangle's slopes, and of the metric at its corners times the area.
DRAPE_WIDE void find_changes(const std::vector<MeshCloth::Triangle>& triangles,
                             const ClothTangent::Element* element, const Four* x, Four* changes,
                             Four* at_points) {
  for (const MeshCloth::Triangle& t : triangles) {
    const ClothTangent::Element& e = *element++;
    Four &du = *changes++, &dv = *changes++, &metric = *changes++;
    set_sum<3>(du, t.d_u, t.corner, x);
    set_sum<3>(dv, t.d_v, t.corner, x);
    metric = Four{2 * dot(e.u, du), dot(e.u, dv) + dot(e.v, du), 2 * dot(e.v, dv), 0};
    const Four part = t.area / 3 * metric;
    for (const int corner : t.corner) at_points[corner] += part;
  }
}

DRAPE_WIDE void add_elements(const std::vector<MeshCloth::Triangle>& triangles, double twist_n_m,
                             const ClothTangent::Element* element, const Four* x,
                             const Four* changes, const Four* at_points, Four* product) {
  for (const MeshCloth::Triangle& t : triangles) {
    const ClothTangent::Element& e = *element++;
    const Four du = *changes++, dv = *changes++, metric = *changes++;
    const Four by =
        metric[0] * e.change[0] + metric[1] * e.change[1] + metric[2] * e.change[2] +
        t.area * (at_points[t.corner[0]] + at_points[t.corner[1]] + at_points[t.corner[2]]);
    const Four of_u = 2 * by[0] * e.u + by[1] * e.v + 2 * e.stress[0] * du + e.stress[1] * dv;
    const Four of_v = by[1] * e.u + 2 * by[2] * e.v + e.stress[1] * du + 2 * e.stress[2] * dv;
    for (int k = 0; k < 3; ++k) product[t.corner[k]] += t.d_u[k] * of_u + t.d_v[k] * of_v;
    Four warp, weft, across;
    set_sum<6>(warp, t.d_uu, t.unknown, x);
    set_sum<6>(weft, t.d_vv, t.unknown, x);
    set_sum<6>(across, t.d_uv, t.unknown, x);
    const Four of_uu = e.secant[0] * warp + e.rise[0] * dot(e.bent[0], warp) * e.bent[0];
    const Four of_vv = e.secant[1] * weft + e.rise[1] * dot(e.bent[1], weft) * e.bent[1];
    const Four of_uv = t.area * twist_n_m * across;
    for (int k = 0; k < 6; ++k)
      product[t.unknown[k]] += t.d_uu[k] * of_uu + t.d_vv[k] * of_vv + t.d_uv[k] * of_uv;
  }
}

}  // namespace

ClothTangent::ClothTangent(const MeshCloth& cloth, const State& state)
    : cloth_(cloth), elements_(cloth.triangles_.size()), at_points_(3 * cloth.area_.size()) {
  const ClothLaws& laws = cloth.laws_;
  if (laws.friction) state_ = state;
  const double in_triangles = cloth.in_triangles_, at_points = 1 - in_triangles;
  const std::vector<Vector3d> metric = cloth.metrics(state);
  std::vector<Vector3d> stress(metric.size());
  for (std::size_t i = 0; i < metric.size(); ++i) {
    const MetricStrain strain(metric[i]);
    const double* slip = laws.friction
                             ? cloth.memory_.shear.data() + laws.friction->shear.elements.size() * i
                             : nullptr;
    stress[i] = at_points * stress_of(strain, strain.angle(), laws);
    if (slip != nullptr)
      stress[i] += strain.of_angle(laws.friction->shear.force(strain.angle(), slip));
    for (int k = 0; k < 3; ++k)
      set(at_points_[3 * i + k],
          stress_change(strain, Vector3d::Unit(k), laws, at_points, slip) / 3);
  }
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const MeshCloth::Triangle& t = cloth.triangles_[i];
    Element& e = elements_[i];
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    const MetricStrain strain(metric_of(u, v));
    Vector3d pull = in_triangles * stress_of(strain, strain.angle(), laws);
    for (const int corner : t.corner) pull += stress[corner] / 3;
    set(e.u, u);
    set(e.v, v);
    set(e.stress, t.area * pull);
    for (int k = 0; k < 3; ++k)
      set(e.change[k],
          t.area * stress_change(strain, Vector3d::Unit(k), laws, in_triangles, nullptr));
    for (int d = 0; d < 2; ++d) {
      const Vector3d c = combined(d == 0 ? t.d_uu : t.d_vv, t.unknown, state);
      const ForceCurve& curve = laws.bending[d];
      const double size = c.norm(), secant = size > 0 ? curve.value(size) / size : curve.slope;
      e.secant[d] = t.area * secant;
      e.rise[d] = size > 0 ? t.area * (curve.tangent(size) - secant) : 0;
      set(e.bent[d], size > 0 ? Vector3d(c / size) : c);
    }
  }
}

void ClothTangent::add_products(const State& direction, State& product) const {
  const std::size_t count = direction.size(), points = cloth_.area_.size();
  Fours x(count), found(count), changes(3 * elements_.size()), at_points(points);
  for (std::size_t i = 0; i < count; ++i) set(x[i], direction[i]);
  find_changes(cloth_.triangles_, elements_.data(), x.data(), changes.data(), at_points.data());
  for (std::size_t i = 0; i < points; ++i) {
    const Four of = at_points[i] / cloth_.area_[i];
    at_points[i] =
        of[0] * at_points_[3 * i] + of[1] * at_points_[3 * i + 1] + of[2] * at_points_[3 * i + 2];
  }
  MeshCloth::pull_seams(cloth_.seams_, x.data(), found.data());
  for (std::size_t i = 0; i < count; ++i) found[i] = -found[i];
  add_elements(cloth_.triangles_, cloth_.laws_.twist_n_m, elements_.data(), x.data(),
               changes.data(), at_points.data(), found.data());
  for (std::size_t i = 0; i < count; ++i)
    product[i] += Vector3d(found[i][0], found[i][1], found[i][2]);
  if (cloth_.laws_.friction) add_friction_products(direction, product);
}

void ClothTangent::add_friction_products(const State& direction, State& product) const {
  const ClothFriction& friction = *cloth_.laws_.friction;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const MeshCloth::Triangle& t = cloth_.triangles_[i];
    const Vector3d u = combined(t.d_u, t.unknown, state_), v = combined(t.d_v, t.unknown, state_);
    const Vector3d du = combined(t.d_u, t.unknown, direction),
                   dv = combined(t.d_v, t.unknown, direction);
    for (int d = 0; d < 2; ++d) {
      const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
      const Vector3d c = combined(weight, t.unknown, state_);
      const FrictionStack& stack = friction.bending[d];
      const double* slip = cloth_.memory_.bending[d].data() + stack.elements.size() * i;
      const NormalCurvature own = normal_curvature(c, u, v);
      const NormalCurvature other =
          curvature_change(c, u, v, combined(weight, t.unknown, direction), du, dv);
      const double force = t.area * stack.force(own.value, slip);
      const double rise = t.area * stack.tangent(own.value, slip) * other.value;
      const Vector3d of_c = rise * own.of_c + force * other.of_c;
      const Vector3d of_a = rise * own.of_a + force * other.of_a;
      const Vector3d of_b = rise * own.of_b + force * other.of_b;
      for (int k = 0; k < 3; ++k) product[t.corner[k]] += t.d_u[k] * of_a + t.d_v[k] * of_b;
      for (int k = 0; k < 6; ++k) product[t.unknown[k]] += weight[k] * of_c;
    }
  }
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/mesh_cloth.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/units.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using State = MeshCloth::State;

// Relative to the jump's energy over the adjacent triangles; see MeshCloth.
constexpr double kSeam = 2;

/// Computes first derivatives per triangle, and its share of the metric at each corner times area.
DRAPE_WIDE void find_slopes(const std::vector<MeshCloth::Triangle>& triangles, const Four* x,
                            Four* slopes, Four* metric) {
  for (const MeshCloth::Triangle& t : triangles) {
    Four &u = *slopes++, &v = *slopes++;
    set_sum<3>(u, t.d_u, t.corner, x);
    set_sum<3>(v, t.d_v, t.corner, x);
    const Four part = t.area / 3 * Four{dot(u, u), dot(u, v), dot(v, v), 0};
    for (const int corner : t.corner) metric[corner] += part;
  }
}

/// Subtracts the forces due to a triangle's stress and bending; returns the energies of bending
/// along warp, along weft and of twist.
DRAPE_WIDE void pull_triangles(const std::vector<MeshCloth::Triangle>& triangles,
                               const ClothLaws& laws, const Four* x, const Four* slopes,
                               const Four* stress, Four* force, InternalEnergies& sum) {
  double twist = 0;
  for (const MeshCloth::Triangle& t : triangles) {
    const Four u = *slopes++, v = *slopes++, pull = *stress++;
    const Four of_u = 2 * pull[0] * u + pull[1] * v, of_v = pull[1] * u + 2 * pull[2] * v;
    for (int k = 0; k < 3; ++k) force[t.corner[k]] -= t.d_u[k] * of_u + t.d_v[k] * of_v;
    Four warp, weft, across;
    set_sum<6>(warp, t.d_uu, t.unknown, x);
    set_sum<6>(weft, t.d_vv, t.unknown, x);
    set_sum<6>(across, t.d_uv, t.unknown, x);
    const auto secant = [&](const Four& curvature, const ForceCurve& curve) {
      const double size = std::sqrt(dot(curvature, curvature));
      sum.bending_j += t.area * curve.energy(size);
      return t.area * (size > 0 ? curve.value(size) / size : curve.slope);
    };
    const Four of_uu = secant(warp, laws.bending[0]) * warp;
    const Four of_vv = secant(weft, laws.bending[1]) * weft;
    const Four of_uv = t.area * laws.twist_n_m * across;
    twist += dot(of_uv, across);
    for (int k = 0; k < 6; ++k)
      force[t.unknown[k]] -= t.d_uu[k] * of_uu + t.d_vv[k] * of_vv + t.d_uv[k] * of_uv;
  }
  sum.twist_j += twist / 2;
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

MeshCloth::MeshCloth(MaterialMesh mesh, ClothLaws laws, double in_triangles)
    : mesh_(std::move(mesh)),
      laws_(std::move(laws)),
      in_triangles_(in_triangles),
      area_(mesh_.points_m.size(), 0.0) {
  for (int t = 0; t < static_cast<int>(mesh_.triangles.size()); ++t) {
    Triangle triangle;
    triangle.corner = mesh_.triangles[t];
    triangle.area = mesh_.area_m2(t);
    std::array<Vector2d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = mesh_.points_m[triangle.corner[k]];
    for (int k = 0; k < 3; ++k) {
      const Vector2d side = p[(k + 2) % 3] - p[(k + 1) % 3];
      triangle.d_u[k] = -side.y() / (2 * triangle.area);
      triangle.d_v[k] = side.x() / (2 * triangle.area);
      triangle.unknown[k] = triangle.corner[k];
      triangle.unknown[3 + k] = points() + mesh_.edges_of[t][k];
      area_[triangle.corner[k]] += triangle.area / 3;
    }
    // q = c0 + c1 u + c2 v + c3 u^2/2 + c4 u v + c5 v^2/2 about the centre, scaled by the size.
    const Vector2d middle = (p[0] + p[1] + p[2]) / 3;
    const double size = std::sqrt(triangle.area);
    Eigen::Matrix<double, 6, 6> rows;
    for (int k = 0; k < 3; ++k) {
      const Vector2d at = (p[k] - middle) / size;
      rows.row(k) << 1, at.x(), at.y(), at.x() * at.x() / 2, at.x() * at.y(), at.y() * at.y() / 2;
      const int edge = mesh_.edges_of[t][k];
      const Vector2d m = (material_m(points() + edge) - middle) / size, n = normal_of(edge);
      rows.row(3 + k) << 0, n.x(), n.y(), n.x() * m.x(), n.x() * m.y() + n.y() * m.x(),
          n.y() * m.y();
    }
    const Eigen::Matrix<double, 6, 6> inverse = rows.fullPivLu().inverse();
    for (int k = 0; k < 6; ++k) {
      // The derivative at an edge is per metre: `size` of it is one unit.
      const double scale = (k < 3 ? 1 : size) / (size * size);
      triangle.d_uu[k] = scale * inverse(3, k);
      triangle.d_uv[k] = scale * inverse(4, k);
      triangle.d_vv[k] = scale * inverse(5, k);
    }
    triangles_.push_back(triangle);
  }
  for (int e = 0; e < static_cast<int>(mesh_.edges.size()); ++e)
    if (mesh_.edges[e].left >= 0 && mesh_.edges[e].right >= 0) seams_.push_back(seam_of(e));
  for (const double area : area_) mass_.push_back(laws_.density_kg_per_m2 * area);
  if (!laws_.friction) return;
  for (int d = 0; d < 2; ++d)
    memory_.bending[d].assign(laws_.friction->bending[d].elements.size() * triangles_.size(), 0.0);
  memory_.shear.assign(laws_.friction->shear.elements.size() * area_.size(), 0.0);
}

std::vector<Vector3d> MeshCloth::metrics(const State& state) const {
  std::vector<Vector3d> metric(area_.size(), Vector3d::Zero());
  for (const Triangle& t : triangles_) {
    const Vector3d part =
        t.area / 3 *
        metric_of(combined(t.d_u, t.unknown, state), combined(t.d_v, t.unknown, state));
    for (const int corner : t.corner) metric[corner] += part;
  }
  for (std::size_t i = 0; i < metric.size(); ++i) metric[i] /= area_[i];
  return metric;
}

MeshCloth::Seam MeshCloth::seam_of(int edge) const {
  const Vector2d n = normal_of(edge), along(n.y(), -n.x());
  const double uu = along.x() * along.x(), vv = along.y() * along.y();
  const double uv = along.x() * along.y();
  Seam seam;
  double area = 0;
  for (const bool right : {false, true}) {
    const Triangle& t = triangles_[right ? mesh_.edges[edge].right : mesh_.edges[edge].left];
    for (int k = 0; k < 6; ++k) {
      const int at = (right ? 6 : 0) + k;
      seam.unknown[at] = t.unknown[k];
      seam.weight[at] = (right ? -1 : 1) * (uu * t.d_uu[k] + 2 * uv * t.d_uv[k] + vv * t.d_vv[k]);
    }
    area += t.area / 3;
  }
  seam.stiffness = kSeam * area *
                   (laws_.bending[0].slope * uu * uu + laws_.bending[1].slope * vv * vv +
                    laws_.twist_n_m * uv * uv);
  return seam;
}

Vector2d MeshCloth::material_m(int unknown) const {
  if (unknown < points()) return mesh_.points_m[unknown];
  const MaterialMesh::Edge& side = mesh_.edges[unknown - points()];
  return (mesh_.points_m[side.from] + mesh_.points_m[side.to]) / 2;
}

Vector2d MeshCloth::normal_of(int edge) const {
  const Vector2d along =
      (mesh_.points_m[mesh_.edges[edge].to] - mesh_.points_m[mesh_.edges[edge].from]).normalized();
  return {-along.y(), along.x()};
}

double MeshCloth::pull_seams(const std::vector<Seam>& seams, const Four* x, Four* force) {
  double sum = 0;
  for (const Seam& seam : seams) {
    Four jump;
    set_sum<12>(jump, seam.weight, seam.unknown, x);
    const Four pull = seam.stiffness * jump;
    sum += dot(jump, pull);
    for (int k = 0; k < 12; ++k) force[seam.unknown[k]] -= seam.weight[k] * pull;
  }
  return sum / 2;
}

InternalEnergies MeshCloth::energies(const State& state) const {
  State unused(state.size(), Vector3d::Zero());
  return add_forces(state, unused);
}

InternalEnergies MeshCloth::add_forces(const State& state, State& force) const {
  InternalEnergies sum;
  const std::size_t count = state.size(), points = area_.size();
  Fours x(count), pulled(count), slopes(2 * triangles_.size()), metric(points);
  Fours stress(triangles_.size());
  for (std::size_t i = 0; i < count; ++i) x[i] = Four{state[i].x(), state[i].y(), state[i].z(), 0};
  find_slopes(triangles_, x.data(), slopes.data(), metric.data());
  const auto stress_in = [&](double area, const Vector3d& of) -> Vector3d {
    const MetricStrain strain(of);
    const double angle = strain.angle();
    sum.stretch_j +=
        area * (laws_.tensile[0].energy(strain.a - 1) + laws_.tensile[1].energy(strain.b - 1));
    sum.shear_j += area * laws_.shear.energy(std::abs(angle));
    return area * stress_of(strain, angle, laws_);
  };
  const auto first_three = [](const Four& of) { return Vector3d(of[0], of[1], of[2]); };
  for (std::size_t i = 0; i < points; ++i) {
    const Vector3d of = first_three(metric[i]) / area_[i];
    Vector3d pull = stress_in((1 - in_triangles_) * area_[i], of);
    if (laws_.friction) {
      const FrictionStack& stack = laws_.friction->shear;
      const double* slip = memory_.shear.data() + stack.elements.size() * i;
      const MetricStrain strain(of);
      sum.shear_j += area_[i] * stack.potential(strain.angle(), slip);
      pull += area_[i] * strain.of_angle(stack.force(strain.angle(), slip));
    }
    pull /= 3 * area_[i];
    metric[i] = Four{pull[0], pull[1], pull[2], 0};  // holds stress from here on
  }
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Four u = slopes[2 * i], v = slopes[2 * i + 1];
    const Vector3d own = stress_in(in_triangles_ * t.area, {dot(u, u), dot(u, v), dot(v, v)});
    stress[i] = Four{own[0], own[1], own[2], 0} +
                t.area * (metric[t.corner[0]] + metric[t.corner[1]] + metric[t.corner[2]]);
  }
  pull_triangles(triangles_, laws_, x.data(), slopes.data(), stress.data(), pulled.data(), sum);
  sum.bending_j += pull_seams(seams_, x.data(), pulled.data());
  for (std::size_t i = 0; i < count; ++i) force[i] += first_three(pulled[i]);
  if (laws_.friction) add_friction_forces(state, force, sum);
  return sum;
}

/// Calls visit(index of a triangle, direction, index of its first slip, curvature) for each
/// triangle along warp and weft.
template <class Visit>
void MeshCloth::visit_bending_friction(const State& state, Visit visit) const {
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    for (int d = 0; d < 2; ++d)
      visit(i, d, laws_.friction->bending[d].elements.size() * i,
            normal_curvature(combined(d == 0 ? t.d_uu : t.d_vv, t.unknown, state), u, v));
  }
}

std::vector<std::array<double, 2>> MeshCloth::bending_stiffness(const State& state) const {
  std::vector<std::array<double, 2>> stiffness;
  const auto steeper = [](const ForceCurve& curve, double x) {
    return std::max(curve.tangent(x), x > 0 ? curve.value(x) / x : curve.slope);
  };
  for (const Triangle& t : triangles_)
    stiffness.push_back({steeper(laws_.bending[0], combined(t.d_uu, t.unknown, state).norm()),
                         steeper(laws_.bending[1], combined(t.d_vv, t.unknown, state).norm())});
  if (!laws_.friction) return stiffness;
  visit_bending_friction(
      state, [&](std::size_t i, int d, std::size_t slip, const NormalCurvature& curvature) {
        stiffness[i][d] += std::max(0.0, laws_.friction->bending[d].tangent(
                                             curvature.value, memory_.bending[d].data() + slip));
      });
  return stiffness;
}

double MeshCloth::settle(const State& state) {
  if (!laws_.friction) return 0;
  const ClothFriction& friction = *laws_.friction;
  double taken = 0;
  visit_bending_friction(
      state, [&](std::size_t i, int d, std::size_t slip, const NormalCurvature& curvature) {
        taken += triangles_[i].area *
                 friction.bending[d].settle(curvature.value, memory_.bending[d].data() + slip);
      });
  const std::vector<Vector3d> metric = metrics(state);
  const std::size_t elements = friction.shear.elements.size();
  for (std::size_t i = 0; i < metric.size(); ++i)
    taken += area_[i] * friction.shear.settle(MetricStrain(metric[i]).angle(),
                                              memory_.shear.data() + elements * i);
  dissipated_j_ += taken;
  return taken;
}

void MeshCloth::take_over(const MeshCloth& other, const State& of_other, const State& own) {
  if (!laws_.friction) return;
  const auto nearest = [](const std::vector<Vector2d>& places, const Vector2d& p) {
    const auto nearer = [&](const Vector2d& a, const Vector2d& b) {
      return (a - p).squaredNorm() < (b - p).squaredNorm();
    };
    return static_cast<std::size_t>(std::min_element(places.begin(), places.end(), nearer) -
                                    places.begin());
  };
  const auto middle = [](const MeshCloth& cloth, std::size_t triangle) {
    Vector2d sum = Vector2d::Zero();
    for (const int corner : cloth.triangles_[triangle].corner)
      sum += cloth.mesh_.points_m[corner] / 3;
    return sum;
  };
  const ClothFriction& friction = *laws_.friction;
  const auto take = [](const FrictionStack& stack, double strain, double others, const double* from,
                       double* slip) {
    for (std::size_t e = 0; e < stack.elements.size(); ++e) slip[e] = strain - (others - from[e]);
  };
  std::vector<Vector2d> middles;
  std::vector<std::array<double, 2>> bent;
  other.visit_bending_friction(
      of_other, [&](std::size_t i, int d, std::size_t, const NormalCurvature& curvature) {
        if (d == 0) {
          middles.push_back(middle(other, i));
          bent.emplace_back();
        }
        bent.back()[d] = curvature.value;
      });
  std::size_t from = 0;
  visit_bending_friction(
      own, [&](std::size_t i, int d, std::size_t slip, const NormalCurvature& curvature) {
        if (d == 0) from = nearest(middles, middle(*this, i));
        const FrictionStack& stack = friction.bending[d];
        take(stack, curvature.value, bent[from][d],
             other.memory_.bending[d].data() + stack.elements.size() * from,
             memory_.bending[d].data() + slip);
      });
  const std::vector<Vector3d> metric = metrics(own), others = other.metrics(of_other);
  const std::size_t count = friction.shear.elements.size();
  for (std::size_t i = 0; i < metric.size(); ++i) {
    from = nearest(other.mesh_.points_m, mesh_.points_m[i]);
    take(friction.shear, MetricStrain(metric[i]).angle(), MetricStrain(others[from]).angle(),
         other.memory_.shear.data() + count * from, memory_.shear.data() + count * i);
  }
  dissipated_j_ = other.dissipated_j_;
}

void MeshCloth::add_friction_forces(const State& state, State& force, InternalEnergies& sum) const {
  const ClothFriction& friction = *laws_.friction;
  visit_bending_friction(
      state, [&](std::size_t i, int d, std::size_t first, const NormalCurvature& curvature) {
        const Triangle& t = triangles_[i];
        const double* slip = memory_.bending[d].data() + first;
        sum.bending_j += t.area * friction.bending[d].potential(curvature.value, slip);
        const double pull = t.area * friction.bending[d].force(curvature.value, slip);
        const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
        for (int k = 0; k < 6; ++k) force[t.unknown[k]] -= pull * weight[k] * curvature.of_c;
        for (int k = 0; k < 3; ++k)
          force[t.unknown[k]] -= pull * (t.d_u[k] * curvature.of_a + t.d_v[k] * curvature.of_b);
      });
}

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

std::vector<std::array<int, 3>> facets_of(const MaterialMesh& mesh) {
  const auto points = static_cast<int>(mesh.points_m.size());
  std::vector<std::array<int, 3>> facets;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::array<int, 3>& corner = mesh.triangles[t];
    std::array<int, 3> middle = mesh.edges_of[t];  // midpoint opposite each corner
    for (int& m : middle) m += points;
    for (int k = 0; k < 3; ++k)
      facets.push_back({corner[k], middle[(k + 2) % 3], middle[(k + 1) % 3]});
    facets.push_back(middle);
  }
  return facets;
}

std::string ply_text(const std::string& comment, const State& points_m,
                     const std::vector<Vector2d>& uv,
                     const std::vector<std::array<int, 3>>& faces) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment {}\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n{}element face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      comment, points_m.size(), uv.empty() ? "" : "property double u\nproperty double v\n",
      faces.size());
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const Vector3d p = points_m[i] / units::mm;
    text += fmt::format("{:.6f} {:.6f} {:.6f}", p.x(), p.y(), p.z());
    if (!uv.empty()) text += fmt::format(" {:.9f} {:.9f}", uv[i].x(), uv[i].y());
    text += '\n';
  }
  for (const auto& face : faces) text += fmt::format("3 {} {} {}\n", face[0], face[1], face[2]);
  return text;
}

ClothSurface::ClothSurface(const MeshCloth& cloth)
    : cloth_(cloth), facets_(facets_of(cloth.mesh())) {
  const MaterialMesh& mesh = cloth.mesh();
  for (const MaterialMesh::Edge& edge : mesh.edges) {
    const Vector2d d = mesh.points_m[edge.to] - mesh.points_m[edge.from];
    std::vector<std::pair<int, double>> weights = {{edge.from, 0.5}, {edge.to, 0.5}};
    const auto add = [&](int unknown, double weight) {
      const auto at = std::find_if(weights.begin(), weights.end(),
                                   [&](const auto& w) { return w.first == unknown; });
      if (at == weights.end())
        weights.emplace_back(unknown, weight);
      else
        at->second += weight;
    };
    const double beside = edge.left >= 0 && edge.right >= 0 ? 2 : 1;
    for (const int triangle : {edge.left, edge.right}) {
      if (triangle < 0) continue;
      const MeshCloth::Triangle& t = cloth.triangles()[triangle];
      for (int k = 0; k < 6; ++k)
        add(t.unknown[k], -(d.x() * d.x() * t.d_uu[k] + 2 * d.x() * d.y() * t.d_uv[k] +
                            d.y() * d.y() * t.d_vv[k]) /
                              (8 * beside));
    }
    middle_.insert(middle_.end(), weights.begin(), weights.end());
    begin_.push_back(middle_.size());
  }
}

State ClothSurface::nodes(const State& state) const {
  State places;
  find_nodes(state, places);
  return places;
}

void ClothSurface::find_nodes(const State& state, State& places) const {
  places.resize(state.size());
  for (int node = 0; node < std::ssize(state); ++node) places[node] = place(state, node);
}

Vector3d ClothSurface::place(const State& state, int node) const {
  const int side = node - cloth_.points();
  if (side < 0) return state[node];
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = begin_[side]; k < begin_[side + 1]; ++k)
    sum += middle_[k].second * state[middle_[k].first];
  return sum;
}

void ClothSurface::add_force(int node, const Vector3d& on_node, State& force) const {
  const int side = node - cloth_.points();
  if (side < 0) {
    force[node] += on_node;
    return;
  }
  for (std::size_t k = begin_[side]; k < begin_[side + 1]; ++k)
    force[middle_[k].first] += middle_[k].second * on_node;
}

void ClothSurface::add_forces(const State& on_nodes, State& force) const {
  for (int node = 0; node < std::ssize(on_nodes); ++node)
    if (!on_nodes[node].isZero(0)) add_force(node, on_nodes[node], force);
}

std::array<double, 3> ClothSurface::corner_weights(int facet, const Vector3d& weights) const {
  const std::array<int, 6>& unknown = cloth_.triangles()[facet / 4].unknown;
  std::array<double, 3> sum{};
  for (int k = 0; k < 3; ++k) {
    const auto at = std::find(unknown.begin(), unknown.end(), facets_[facet][k]) - unknown.begin();
    for (int c = 0; c < 3; ++c) {
      if (at < 3)
        sum[c] += at == c ? weights[k] : 0;
      else
        sum[c] += at - 3 == c ? 0 : weights[k] / 2;
    }
  }
  return sum;
}

std::vector<std::pair<int, double>> ClothSurface::side_weights(int side) const {
  std::vector<std::pair<int, double>> weights;
  for (std::size_t m = begin_[side]; m < begin_[side + 1]; ++m)
    if (middle_[m].first >= cloth_.points()) weights.push_back(middle_[m]);
  return weights;
}

void SurfaceProducts::clear() {
  mixed_.clear();
  whole_.clear();
  for (const int node : nodes_) number_[node] = -1;
  nodes_.clear();
}

std::array<int, 4> SurfaceProducts::numbers_of(const std::array<int, 4>& nodes) {
  std::array<int, 4> numbers{};
  for (int k = 0; k < 4; ++k) {
    const auto node = static_cast<std::size_t>(nodes[k]);
    if (node >= number_.size()) number_.resize(node + 1, -1);
    if (number_[node] < 0) {
      number_[node] = static_cast<int>(nodes_.size());
      nodes_.push_back(nodes[k]);
    }
    numbers[k] = number_[node];
  }
  return numbers;
}

void SurfaceProducts::add(const std::array<int, 4>& nodes, const std::array<double, 4>& weights,
                          const Eigen::Matrix3d& second) {
  mixed_.push_back({numbers_of(nodes), weights, second});
}

void SurfaceProducts::add(const std::array<int, 4>& nodes,
                          const Eigen::Matrix<double, 12, 12>& second) {
  whole_.push_back({numbers_of(nodes), second});
}

void SurfaceProducts::add_products(const ClothSurface& surface, const State& direction,
                                   State& product) const {
  State moved, on_nodes(nodes_.size(), Vector3d::Zero());
  for (const int node : nodes_) moved.push_back(surface.place(direction, node));
  for (const Mixed& of : mixed_) {
    Vector3d along = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) along += of.weight[k] * moved[of.node[k]];
    along = of.second * along;
    for (int k = 0; k < 4; ++k) on_nodes[of.node[k]] += of.weight[k] * along;
  }
  Eigen::Matrix<double, 12, 1> four;
  for (const Whole& of : whole_) {
    for (int k = 0; k < 4; ++k) four.segment<3>(3 * k) = moved[of.node[k]];
    four = of.second * four;
    for (int k = 0; k < 4; ++k) on_nodes[of.node[k]] += four.segment<3>(3 * k);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    surface.add_force(nodes_[i], on_nodes[i], product);
}

}  // namespace drape::simulate

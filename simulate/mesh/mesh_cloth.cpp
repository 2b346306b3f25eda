// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/mesh_cloth.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "simulate/cloth/normal_curvature.hpp"
#include "simulate/mesh/membrane.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSeam = 2;  // of the jump's energy over the triangles beside; see MeshCloth
constexpr double kNoLength = 1e-30;  // keeps quotients of vectors that vanish finite

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
    // q = c0 + c1 u + c2 v + c3 u^2/2 + c4 u v + c5 v^2/2 about the middle, in units of the size.
    const Vector2d middle = (p[0] + p[1] + p[2]) / 3;
    const double size = std::sqrt(triangle.area);
    Eigen::Matrix<double, 6, 6> rows;
    for (int k = 0; k < 3; ++k) {
      const Vector2d at = (p[k] - middle) / size;
      rows.row(k) << 1, at.x(), at.y(), at.x() * at.x() / 2, at.x() * at.y(), at.y() * at.y() / 2;
      const int edge = mesh_.edges_of[t][k];
      const Vector2d m = (middle_of(edge) - middle) / size, n = normal_of(edge);
      rows.row(3 + k) << 0, n.x(), n.y(), n.x() * m.x(), n.x() * m.y() + n.y() * m.x(),
          n.y() * m.y();
    }
    const Eigen::Matrix<double, 6, 6> inverse = rows.fullPivLu().inverse();
    for (int k = 0; k < 6; ++k) {
      // A side's derivative is per metre: `size` of it is one unit.
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

/// Calls visit(triangle, slips' index, curvature along warp and weft) for each triangle.
template <class Visit>
void MeshCloth::visit_bending_friction(const State& state, Visit visit) const {
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    const std::array<NormalCurvature, 2> curvature = {
        normal_curvature(combined(t.d_uu, t.unknown, state), u, v),
        normal_curvature(combined(t.d_vv, t.unknown, state), u, v)};
    visit(t, i, curvature);
  }
}

std::vector<std::array<double, 2>> MeshCloth::bending_stiffness(const State& state) const {
  std::vector<std::array<double, 2>> stiffness;
  const auto steeper = [](const ForceCurve& curve, double x) {
    return std::max(curve.tangent(x), x > kNoLength ? curve.value(x) / x : curve.slope);
  };
  for (const Triangle& t : triangles_)
    stiffness.push_back({steeper(laws_.bending[0], combined(t.d_uu, t.unknown, state).norm()),
                         steeper(laws_.bending[1], combined(t.d_vv, t.unknown, state).norm())});
  if (!laws_.friction) return stiffness;
  visit_bending_friction(
      state, [&](const Triangle&, std::size_t i, const std::array<NormalCurvature, 2>& curvature) {
        for (int d = 0; d < 2; ++d) {
          const FrictionStack& stack = laws_.friction->bending[d];
          const double* slip = memory_.bending[d].data() + stack.elements.size() * i;
          stiffness[i][d] += std::max(0.0, stack.tangent(curvature[d].value, slip));
        }
      });
  return stiffness;
}

double MeshCloth::settle(const State& state) {
  if (!laws_.friction) return 0;
  const ClothFriction& friction = *laws_.friction;
  double taken = 0;
  visit_bending_friction(state, [&](const Triangle& t, std::size_t i,
                                    const std::array<NormalCurvature, 2>& curvature) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      taken += t.area * stack.settle(curvature[d].value,
                                     memory_.bending[d].data() + stack.elements.size() * i);
    }
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
  const auto middle = [](const MeshCloth& cloth, const Triangle& t) {
    Vector2d sum = Vector2d::Zero();
    for (const int corner : t.corner) sum += cloth.mesh_.points_m[corner] / 3;
    return sum;
  };
  const ClothFriction& friction = *laws_.friction;
  const auto take = [](const FrictionStack& stack, double strain, double others, const double* from,
                       double* slip) {
    for (std::size_t e = 0; e < stack.elements.size(); ++e) slip[e] = strain - (others - from[e]);
  };
  std::vector<Vector2d> middles;
  std::vector<std::array<double, 2>> bent;
  other.visit_bending_friction(of_other, [&](const Triangle& t, std::size_t,
                                             const std::array<NormalCurvature, 2>& curvature) {
    middles.push_back(middle(other, t));
    bent.push_back({curvature[0].value, curvature[1].value});
  });
  visit_bending_friction(own, [&](const Triangle& t, std::size_t i,
                                  const std::array<NormalCurvature, 2>& curvature) {
    const std::size_t from = nearest(middles, middle(*this, t));
    for (int d = 0; d < 2; ++d) {
      const std::size_t count = friction.bending[d].elements.size();
      take(friction.bending[d], curvature[d].value, bent[from][d],
           other.memory_.bending[d].data() + count * from, memory_.bending[d].data() + count * i);
    }
  });
  const std::vector<Vector3d> metric = metrics(own), others = other.metrics(of_other);
  const std::size_t count = friction.shear.elements.size();
  for (std::size_t i = 0; i < metric.size(); ++i) {
    const std::size_t from = nearest(other.mesh_.points_m, mesh_.points_m[i]);
    take(friction.shear, MetricStrain(metric[i]).angle(), MetricStrain(others[from]).angle(),
         other.memory_.shear.data() + count * from, memory_.shear.data() + count * i);
  }
  dissipated_j_ = other.dissipated_j_;
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

Vector2d MeshCloth::middle_of(int edge) const {
  return (mesh_.points_m[mesh_.edges[edge].from] + mesh_.points_m[mesh_.edges[edge].to]) / 2;
}

Vector2d MeshCloth::normal_of(int edge) const {
  const Vector2d along =
      (mesh_.points_m[mesh_.edges[edge].to] - mesh_.points_m[mesh_.edges[edge].from]).normalized();
  return {-along.y(), along.x()};
}

InternalEnergies MeshCloth::energies(const State& state) const {
  InternalEnergies sum;
  const auto add_membrane = [&](double area, const Vector3d& metric) {
    const MetricStrain strain(metric);
    sum.stretch_j +=
        area * (laws_.tensile[0].energy(strain.a - 1) + laws_.tensile[1].energy(strain.b - 1));
    sum.shear_j += area * laws_.shear.energy(std::abs(strain.angle()));
  };
  const std::vector<Vector3d> metric = metrics(state);
  for (std::size_t i = 0; i < metric.size(); ++i)
    add_membrane((1 - in_triangles_) * area_[i], metric[i]);
  for (const Triangle& t : triangles_) {
    add_membrane(in_triangles_ * t.area,
                 metric_of(combined(t.d_u, t.unknown, state), combined(t.d_v, t.unknown, state)));
    sum.bending_j += t.area * (laws_.bending[0].energy(combined(t.d_uu, t.unknown, state).norm()) +
                               laws_.bending[1].energy(combined(t.d_vv, t.unknown, state).norm()));
    sum.twist_j += t.area * laws_.twist_n_m / 2 * combined(t.d_uv, t.unknown, state).squaredNorm();
  }
  for (const Seam& seam : seams_)
    sum.bending_j += seam.stiffness / 2 * combined(seam.weight, seam.unknown, state).squaredNorm();
  if (!laws_.friction) return sum;
  const ClothFriction& friction = *laws_.friction;
  visit_bending_friction(state, [&](const Triangle& t, std::size_t i,
                                    const std::array<NormalCurvature, 2>& curvature) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      sum.bending_j += t.area * stack.potential(curvature[d].value, memory_.bending[d].data() +
                                                                        stack.elements.size() * i);
    }
  });
  const std::size_t elements = friction.shear.elements.size();
  for (std::size_t i = 0; i < metric.size(); ++i)
    sum.shear_j += area_[i] * friction.shear.potential(MetricStrain(metric[i]).angle(),
                                                       memory_.shear.data() + elements * i);
  return sum;
}

void MeshCloth::add_forces(const State& state, State& force) const {
  std::vector<Vector3d> stress = metrics(state);
  for (std::size_t i = 0; i < stress.size(); ++i) {
    const MetricStrain strain(stress[i]);
    stress[i] = (1 - in_triangles_) * stress_of(stress[i], laws_);
    if (!laws_.friction) continue;
    const FrictionStack& stack = laws_.friction->shear;
    stress[i] += strain.of_angle(
        stack.force(strain.angle(), memory_.shear.data() + stack.elements.size() * i));
  }
  for (const Triangle& t : triangles_) {
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    const Vector3d pull =
        t.area * (in_triangles_ * stress_of(metric_of(u, v), laws_) +
                  (stress[t.corner[0]] + stress[t.corner[1]] + stress[t.corner[2]]) / 3);
    const Vector3d of_u = 2 * pull[0] * u + pull[1] * v, of_v = pull[1] * u + 2 * pull[2] * v;
    for (int k = 0; k < 3; ++k) force[t.unknown[k]] -= t.d_u[k] * of_u + t.d_v[k] * of_v;
    const auto moment = [&](const std::array<double, 6>& weight, const ForceCurve& curve) {
      const Vector3d curvature = combined(weight, t.unknown, state);
      const double size = curvature.norm();
      const double secant = size > kNoLength ? curve.value(size) / size : curve.slope;
      return Vector3d(t.area * secant * curvature);
    };
    const Vector3d warp = moment(t.d_uu, laws_.bending[0]);
    const Vector3d weft = moment(t.d_vv, laws_.bending[1]);
    const Vector3d twist = t.area * laws_.twist_n_m * combined(t.d_uv, t.unknown, state);
    for (int k = 0; k < 6; ++k)
      force[t.unknown[k]] -= t.d_uu[k] * warp + t.d_vv[k] * weft + t.d_uv[k] * twist;
  }
  for (const Seam& seam : seams_) {
    const Vector3d jump = seam.stiffness * combined(seam.weight, seam.unknown, state);
    for (int k = 0; k < 12; ++k) force[seam.unknown[k]] -= seam.weight[k] * jump;
  }
  if (!laws_.friction) return;
  const ClothFriction& friction = *laws_.friction;
  visit_bending_friction(state, [&](const Triangle& t, std::size_t i,
                                    const std::array<NormalCurvature, 2>& curvature) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      const double pull = t.area * stack.force(curvature[d].value, memory_.bending[d].data() +
                                                                       stack.elements.size() * i);
      const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
      for (int k = 0; k < 6; ++k) force[t.unknown[k]] -= pull * weight[k] * curvature[d].of_c;
      for (int k = 0; k < 3; ++k)
        force[t.unknown[k]] -= pull * (t.d_u[k] * curvature[d].of_a + t.d_v[k] * curvature[d].of_b);
    }
  });
}

std::vector<double> MeshCloth::stiffness_bounds(const State& state) const {
  std::vector<double> bound(static_cast<std::size_t>(unknowns()), 0.0);
  const auto total = [](const auto& weight) {
    double sum = 0;
    for (const double w : weight) sum += std::abs(w);
    return sum;
  };
  const std::vector<Vector3d> metric = metrics(state);
  std::vector<Eigen::Vector2d> fibre(metric.size());  // N/m, along warp and weft
  for (std::size_t i = 0; i < metric.size(); ++i) {
    const MetricStrain strain(metric[i]);
    // Tangent along the fibre, tension over length across it: the larger of both bounds either.
    for (int d = 0; d < 2; ++d) {
      const ForceCurve& law = laws_.tensile[d];
      const double length = d == 0 ? strain.a : strain.b;
      fibre[i][d] = std::max(law.steepest_up_to(length - 1),
                             std::abs(law.value(length - 1)) / std::max(length, kNoLength));
    }
  }
  // A point's stress acts on all unknowns of its triangles.
  std::vector<Eigen::Vector2d> reach(metric.size(), Eigen::Vector2d::Zero());
  for (const Triangle& t : triangles_)
    for (const int i : t.corner)
      reach[i] += t.area / (3 * area_[i]) * Eigen::Vector2d(total(t.d_u), total(t.d_v));
  const double shear =
      laws_.shear.steepest_up_to(1) + (laws_.friction ? laws_.friction->shear.stiffness() : 0);
  for (const Triangle& t : triangles_) {
    for (const int corner : t.corner) {
      const double u = reach[corner].x(), v = reach[corner].y();
      for (int k = 0; k < 3; ++k)
        bound[t.unknown[k]] += t.area / 3 *
                               (fibre[corner].x() * std::abs(t.d_u[k]) * u +
                                fibre[corner].y() * std::abs(t.d_v[k]) * v +
                                shear * (std::abs(t.d_u[k]) + std::abs(t.d_v[k])) * (u + v));
    }
    double bend[2] = {laws_.bending[0].steepest_up_to(combined(t.d_uu, t.unknown, state).norm()),
                      laws_.bending[1].steepest_up_to(combined(t.d_vv, t.unknown, state).norm())};
    if (laws_.friction)
      for (int d = 0; d < 2; ++d) bend[d] += laws_.friction->bending[d].stiffness();
    for (int k = 0; k < 6; ++k)
      bound[t.unknown[k]] += t.area * (bend[0] * std::abs(t.d_uu[k]) * total(t.d_uu) +
                                       bend[1] * std::abs(t.d_vv[k]) * total(t.d_vv) +
                                       laws_.twist_n_m * std::abs(t.d_uv[k]) * total(t.d_uv));
  }
  for (const Seam& seam : seams_)
    for (int k = 0; k < 12; ++k)
      bound[seam.unknown[k]] += seam.stiffness * std::abs(seam.weight[k]) * total(seam.weight);
  return bound;
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/mesh_cloth.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "simulate/cloth/normal_curvature.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNoLength = 1e-30;  // keeps quotients of vectors that vanish finite

template <std::size_t N>
Vector3d combined(const std::array<double, N>& weight, const std::array<int, 6>& unknown,
                  const MeshCloth::State& state) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 0; k < N; ++k) sum += weight[k] * state[unknown[k]];
  return sum;
}

/// What the two first derivatives pull with: derivatives of the membrane's energy per area.
struct Membrane {
  Vector3d of_u, of_v;
};

Membrane membrane_of(const Vector3d& u, const Vector3d& v, const ClothLaws& laws) {
  const double a = std::max(u.norm(), kNoLength), b = std::max(v.norm(), kNoLength);
  const double sine = std::clamp(u.dot(v) / (a * b), -1.0, 1.0);
  const double cosine = std::max(std::sqrt(1 - sine * sine), 1e-9);
  const double shear = laws.shear.odd_value(std::asin(sine)) / cosine;  // per sine
  return {laws.tensile[0].value(a - 1) * u / a + shear * (v / (a * b) - sine * u / (a * a)),
          laws.tensile[1].value(b - 1) * v / b + shear * (u / (a * b) - sine * v / (b * b))};
}

}  // namespace

MeshCloth::MeshCloth(MaterialMesh mesh, ClothLaws laws)
    : mesh_(std::move(mesh)), laws_(std::move(laws)), mass_(mesh_.points_m.size(), 0.0) {
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
      mass_[triangle.corner[k]] += laws_.density_kg_per_m2 * triangle.area / 3;
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
  if (!laws_.friction) return;
  for (int d = 0; d < 2; ++d)
    memory_.bending[d].assign(laws_.friction->bending[d].elements.size() * triangles_.size(), 0.0);
  memory_.shear.assign(laws_.friction->shear.elements.size() * triangles_.size(), 0.0);
}

/// Calls visit(triangle, index, u, v, curvature along warp, along weft, shear) for each triangle.
template <class Visit>
void MeshCloth::visit_friction(const State& state, Visit visit) const {
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    const std::array<NormalCurvature, 2> curvature = {
        normal_curvature(combined(t.d_uu, t.unknown, state), u, v),
        normal_curvature(combined(t.d_vv, t.unknown, state), u, v)};
    visit(t, i, curvature, shear_angle(u, v));
  }
}

double MeshCloth::settle(const State& state) {
  if (!laws_.friction) return 0;
  const ClothFriction& friction = *laws_.friction;
  double taken = 0;
  visit_friction(state, [&](const Triangle& t, std::size_t i,
                            const std::array<NormalCurvature, 2>& curvature,
                            const ShearAngle& angle) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      taken += t.area * stack.settle(curvature[d].value,
                                     memory_.bending[d].data() + stack.elements.size() * i);
    }
    taken += t.area * friction.shear.settle(
                          angle.value, memory_.shear.data() + friction.shear.elements.size() * i);
  });
  dissipated_j_ += taken;
  return taken;
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
  for (const Triangle& t : triangles_) {
    const Vector3d u = combined(t.d_u, t.unknown, state), v = combined(t.d_v, t.unknown, state);
    const double a = std::max(u.norm(), kNoLength), b = std::max(v.norm(), kNoLength);
    const double angle = std::asin(std::clamp(u.dot(v) / (a * b), -1.0, 1.0));
    sum.stretch_j += t.area * (laws_.tensile[0].energy(a - 1) + laws_.tensile[1].energy(b - 1));
    sum.shear_j += t.area * laws_.shear.energy(std::abs(angle));
    sum.bending_j += t.area * (laws_.bending[0].energy(combined(t.d_uu, t.unknown, state).norm()) +
                               laws_.bending[1].energy(combined(t.d_vv, t.unknown, state).norm()));
    sum.twist_j += t.area * laws_.twist_n_m / 2 * combined(t.d_uv, t.unknown, state).squaredNorm();
  }
  if (!laws_.friction) return sum;
  const ClothFriction& friction = *laws_.friction;
  visit_friction(state, [&](const Triangle& t, std::size_t i,
                            const std::array<NormalCurvature, 2>& curvature,
                            const ShearAngle& angle) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      sum.bending_j += t.area * stack.potential(curvature[d].value, memory_.bending[d].data() +
                                                                        stack.elements.size() * i);
    }
    sum.shear_j +=
        t.area * friction.shear.potential(
                     angle.value, memory_.shear.data() + friction.shear.elements.size() * i);
  });
  return sum;
}

void MeshCloth::add_forces(const State& state, State& force) const {
  for (const Triangle& t : triangles_) {
    const Membrane pull =
        membrane_of(combined(t.d_u, t.unknown, state), combined(t.d_v, t.unknown, state), laws_);
    for (int k = 0; k < 3; ++k)
      force[t.unknown[k]] -= t.area * (t.d_u[k] * pull.of_u + t.d_v[k] * pull.of_v);
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
  if (!laws_.friction) return;
  const ClothFriction& friction = *laws_.friction;
  visit_friction(state, [&](const Triangle& t, std::size_t i,
                            const std::array<NormalCurvature, 2>& curvature,
                            const ShearAngle& angle) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      const double pull = t.area * stack.force(curvature[d].value, memory_.bending[d].data() +
                                                                       stack.elements.size() * i);
      const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
      for (int k = 0; k < 6; ++k) force[t.unknown[k]] -= pull * weight[k] * curvature[d].of_c;
      for (int k = 0; k < 3; ++k)
        force[t.unknown[k]] -= pull * (t.d_u[k] * curvature[d].of_a + t.d_v[k] * curvature[d].of_b);
    }
    const double pull =
        t.area * friction.shear.force(angle.value,
                                      memory_.shear.data() + friction.shear.elements.size() * i);
    for (int k = 0; k < 3; ++k)
      force[t.unknown[k]] -= pull * (t.d_u[k] * angle.of_a + t.d_v[k] * angle.of_b);
  });
}

std::vector<double> MeshCloth::stiffness_bounds(const State& state) const {
  std::vector<double> bound(static_cast<std::size_t>(unknowns()), 0.0);
  for (const Triangle& t : triangles_) {
    const double a = combined(t.d_u, t.unknown, state).norm();
    const double b = combined(t.d_v, t.unknown, state).norm();
    // Tangent along the fibre, tension over length across it: the larger of both bounds either.
    const double warp = std::max(laws_.tensile[0].steepest_up_to(a - 1),
                                 std::abs(laws_.tensile[0].value(a - 1)) / std::max(a, kNoLength));
    const double weft = std::max(laws_.tensile[1].steepest_up_to(b - 1),
                                 std::abs(laws_.tensile[1].value(b - 1)) / std::max(b, kNoLength));
    double shear = laws_.shear.steepest_up_to(1);
    double bend[2] = {laws_.bending[0].steepest_up_to(combined(t.d_uu, t.unknown, state).norm()),
                      laws_.bending[1].steepest_up_to(combined(t.d_vv, t.unknown, state).norm())};
    if (laws_.friction) {
      shear += laws_.friction->shear.stiffness();
      for (int d = 0; d < 2; ++d) bend[d] += laws_.friction->bending[d].stiffness();
    }
    const auto total = [](const auto& weight) {
      double sum = 0;
      for (const double w : weight) sum += std::abs(w);
      return sum;
    };
    const double u = total(t.d_u), v = total(t.d_v);
    for (int k = 0; k < 3; ++k)
      bound[t.unknown[k]] +=
          t.area * (warp * std::abs(t.d_u[k]) * u + weft * std::abs(t.d_v[k]) * v +
                    shear * (std::abs(t.d_u[k]) + std::abs(t.d_v[k])) * (u + v));
    for (int k = 0; k < 6; ++k)
      bound[t.unknown[k]] += t.area * (bend[0] * std::abs(t.d_uu[k]) * total(t.d_uu) +
                                       bend[1] * std::abs(t.d_vv[k]) * total(t.d_vv) +
                                       laws_.twist_n_m * std::abs(t.d_uv[k]) * total(t.d_uv));
  }
  return bound;
}

}  // namespace drape::simulate

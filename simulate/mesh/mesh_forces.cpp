// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "simulate/mesh/four.hpp"
#include "simulate/mesh/membrane.hpp"
#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/mesh/normal_curvature.hpp"

namespace drape::simulate {

namespace {

using Eigen::Vector3d;

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

}  // namespace

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

using Eigen::Vector2d;

/// Calls visit(triangle, index of slips, curvature along warp and weft) for each triangle.
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
    return std::max(curve.tangent(x), x > 0 ? curve.value(x) / x : curve.slope);
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

void MeshCloth::add_friction_forces(const State& state, State& force, InternalEnergies& sum) const {
  const ClothFriction& friction = *laws_.friction;
  visit_bending_friction(state, [&](const Triangle& t, std::size_t i,
                                    const std::array<NormalCurvature, 2>& curvature) {
    for (int d = 0; d < 2; ++d) {
      const FrictionStack& stack = friction.bending[d];
      const double* slip = memory_.bending[d].data() + stack.elements.size() * i;
      sum.bending_j += t.area * stack.potential(curvature[d].value, slip);
      const double pull = t.area * stack.force(curvature[d].value, slip);
      const std::array<double, 6>& weight = d == 0 ? t.d_uu : t.d_vv;
      for (int k = 0; k < 6; ++k) force[t.unknown[k]] -= pull * weight[k] * curvature[d].of_c;
      for (int k = 0; k < 3; ++k)
        force[t.unknown[k]] -= pull * (t.d_u[k] * curvature[d].of_a + t.d_v[k] * curvature[d].of_b);
    }
  });
}

}  // namespace drape::simulate

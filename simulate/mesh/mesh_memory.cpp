// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "simulate/cloth/normal_curvature.hpp"
#include "simulate/mesh/membrane.hpp"
#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/mesh_rest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "simulate/checker/dual.hpp"
#include "simulate/checker/mesh_membrane.hpp"
#include "simulate/checker/mesh_surface.hpp"

namespace drape::simulate {
namespace {

using namespace checker;
using Jet = Dual<18>;  // derivatives by a triangle's corners and sides
using Place = Vector<18>;
constexpr Real kOnDisc = 1e-5L;  // relative to the radius: a place this near to the rim lies on it
constexpr Real kHeld_m = 1e-9L;  // a held point is where it is held up to rounding
constexpr Real kRounding = 1e-6L;    // relative to a force, between double and long double
constexpr Real kOverLimit = 1e-6L;   // relative to a friction element
constexpr Real kOfTriangle = 0.05L;  // fraction of stretch and shear by triangle, the rest by point
constexpr Real kOfSide = 2;          // weight of bending by sides between two triangles

class Judge {
 public:
  explicit Judge(const MeshRest& rest) : rest_(rest) {
    if (rest.scene != nullptr) objects_.emplace(*rest.scene);
  }

  MeshJudgement judge() {
    if (!fits()) return std::move(result_);
    force_.assign(rest_.points_m.size(), Point{});
    moment_.assign(rest_.sides.size(), Point{});
    mass_.assign(rest_.points_m.size(), 0);
    for (std::size_t t = 0; t < rest_.triangles.size(); ++t) add(static_cast<int>(t));
    if (result_.refusals.empty()) {
      stretch();
      bend_over_sides();
    }
    if (over_limit_ > 1 + kOverLimit)
      refuse("a friction element bears {:.2g} of its limit", double(over_limit_));
    hold();
    if (objects_ && seen_.size() == rest_.triangles.size()) {
      surface_.emplace(rest_, seen_);
      press();
    }
    balance();
    enter();
    result_.crossings = surface_ ? surface_->crossings() : crossings_of(rest_);
    if (result_.crossings > 0)
      refuse("the cloth passes through itself in {} places", result_.crossings);
    return std::move(result_);
  }

 private:
  template <class... Values>
  void refuse(fmt::format_string<Values...> text, Values&&... values) {
    result_.refusals.push_back(fmt::format(text, std::forward<Values>(values)...));
  }

  /// Sizes, indices and finite numbers.
  bool fits() {
    const auto count = static_cast<int>(rest_.points_m.size());
    bool fit = rest_.material_m.size() == rest_.points_m.size() &&
               rest_.sides.size() == rest_.of_sides.size() && count > 2;
    for (const Eigen::Vector3d& p : rest_.points_m) fit = fit && p.allFinite();
    for (const Eigen::Vector3d& p : rest_.of_sides) fit = fit && p.allFinite();
    for (std::size_t s = 0; fit && s < rest_.sides.size(); ++s) {
      const auto [from, to] = rest_.sides[s];
      fit = from >= 0 && from < to && to < count &&
            side_at_.emplace(rest_.sides[s], static_cast<int>(s)).second;
    }
    for (std::size_t t = 0; fit && t < rest_.triangles.size(); ++t)
      for (int k = 0; k < 3 && fit; ++k) {
        const int a = rest_.triangles[t][(k + 1) % 3], b = rest_.triangles[t][(k + 2) % 3];
        fit = side_at_.contains({std::min(a, b), std::max(a, b)});
      }
    fit = fit && rest_.pinned.size() == rest_.pinned_in_world.size();
    for (const int i : rest_.pinned) fit = fit && i >= 0 && i < count;
    if (fit && rest_.laws.friction) {
      const ClothFriction& friction = *rest_.laws.friction;
      const std::size_t triangles = rest_.triangles.size();
      for (int d = 0; d < 2; ++d)
        fit &= rest_.memory.bending[d].size() == triangles * friction.bending[d].elements.size();
      fit &= rest_.memory.shear.size() == rest_.points_m.size() * friction.shear.elements.size();
    }
    if (!fit) refuse("points, sides and triangles do not fit each other");
    return fit;
  }

  void add(int t) {
    const std::array<int, 3>& corner = rest_.triangles[t];
    const auto first = between(rest_, corner[0], corner[1]),
               second = between(rest_, corner[0], corner[2]);
    const Real area = (first[0] * second[1] - first[1] * second[0]) / 2;
    if (!(area > 0)) {
      refuse("triangle {} has no area or is turned over", t);
      return;
    }
    // Weights of corners 0 .. 2 and sides 3 .. 5 in the derivatives.
    std::vector<Real> u(6), v(6), uu(6), uv(6), vv(6);
    std::array<int, 6> unknown{};
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3, from = corner[a], to = corner[b];
      const auto d = between(rest_, from, to);
      const Real length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
      const std::array<Real, 2> out = {d[1], -d[0]};  // normal times length
      // The middle of a side has the mean position of its ends ...
      for (const int c : {a, b}) {
        u[c] += out[0] / (2 * area);
        v[c] += out[1] / (2 * area);
      }
      // ... and the gradient along it from its ends, across it from its own derivative.
      const Real turn = from < to ? -1 : 1;
      for (int axis = 0; axis < 2; ++axis) {
        const Real along = d[axis] / (length * length), across = turn * out[axis] / length;
        const auto add_flow = [&](std::vector<Real>& weights, Real flow) {
          weights[b] += flow / area * along;
          weights[a] -= flow / area * along;
          weights[3 + k] += flow / area * across;
        };
        add_flow(axis == 0 ? uu : vv, out[axis]);
        if (axis == 1) add_flow(uv, out[0]);
      }
      unknown[k] = corner[k];
      unknown[3 + k] = side_at_.at({std::min(from, to), std::max(from, to)});
      mass_[corner[k]] += Real(rest_.laws.density_kg_per_m2) * area / 3;
    }
    std::vector<Place> corners(6);
    for (int k = 0; k < 6; ++k) {
      const Point p = point_of(k < 3 ? rest_.points_m[unknown[k]] : rest_.of_sides[unknown[k]]);
      for (int axis = 0; axis < 3; ++axis) {
        corners[k][axis].v = p[axis];
        corners[k][axis].d[3 * k + axis] = 1;
      }
    }
    seen_.push_back({area, unknown, uu, uv, vv});
    const Jet energy =
        area * bending_of(t, combine(corners, u), combine(corners, v), combine(corners, uu),
                          combine(corners, uv), combine(corners, vv));
    result_.energy_j += double(energy.v);
    for (int k = 0; k < 6; ++k)
      for (int axis = 0; axis < 3; ++axis)
        (k < 3 ? force_ : moment_)[unknown[k]][axis] -= energy.d[3 * k + axis];
  }

  /// Energy of bending per area from the derivatives of the position.
  Jet bending_of(int t, const Place& x_u, const Place& x_v, const Place& x_uu, const Place& x_uv,
                 const Place& x_vv) {
    const ClothLaws& laws = rest_.laws;
    Jet sum = work_under(laws.bending[0], root(dot(x_uu, x_uu))) +
              work_under(laws.bending[1], root(dot(x_vv, x_vv))) +
              (Real(laws.twist_n_m) / 2) * dot(x_uv, x_uv);
    if (!laws.friction) return sum;
    Place normal;
    for (int axis = 0; axis < 3; ++axis) {
      const int y = (axis + 1) % 3, z = (axis + 2) % 3;
      normal[axis] = x_u[y] * x_v[z] - x_u[z] * x_v[y];
    }
    const Jet per_size = inverse_root(dot(normal, normal));
    for (int d = 0; d < 2; ++d)
      sum = sum + slipped(laws.friction->bending[d], rest_.memory.bending[d], t,
                          dot(d == 0 ? x_uu : x_vv, normal) * per_size, over_limit_);
    return sum;
  }

  /// Stretch and shear: by far the most of it at the points, from the mean metric of the triangles
  /// around each; a part in the triangles.
  void stretch() {
    std::vector<Metric> metric;
    std::vector<Real> area(rest_.points_m.size(), 0);
    std::vector<std::array<Real, 3>> mean(rest_.points_m.size()), stress(rest_.points_m.size());
    for (std::size_t t = 0; t < rest_.triangles.size(); ++t) {
      metric.push_back(metric_of(rest_, static_cast<int>(t)));
      for (const int i : rest_.triangles[t]) {
        area[i] += metric[t].area / 3;
        for (int k = 0; k < 3; ++k) mean[i][k] += metric[t].area / 3 * metric[t].of[k].v;
      }
    }
    for (std::size_t i = 0; i < mean.size(); ++i) {
      if (!(area[i] > 0)) continue;
      for (Real& m : mean[i]) m /= area[i];
      const Membrane found = membrane_of(rest_.laws, mean[i]);
      MetricJet energy = (1 - kOfTriangle) * found.energy;
      if (rest_.laws.friction)
        energy = energy + slipped(rest_.laws.friction->shear, rest_.memory.shear,
                                  static_cast<int>(i), found.angle, over_limit_);
      result_.energy_j += double(area[i] * energy.v);
      stress[i] = energy.d;
    }
    for (std::size_t t = 0; t < metric.size(); ++t) {
      const std::array<int, 3>& corner = rest_.triangles[t];
      const MetricJet own =
          kOfTriangle *
          membrane_of(rest_.laws, {metric[t].of[0].v, metric[t].of[1].v, metric[t].of[2].v}).energy;
      result_.energy_j += double(metric[t].area * own.v);
      for (int k = 0; k < 3; ++k) {
        const Real pull =
            metric[t].area *
            (own.d[k] + (stress[corner[0]][k] + stress[corner[1]][k] + stress[corner[2]][k]) / 3);
        for (int c = 0; c < 3; ++c)
          for (int axis = 0; axis < 3; ++axis)
            force_[corner[c]][axis] -= pull * metric[t].of[k].d[3 * c + axis];
      }
    }
  }

  /// Bending of what two quadratics differ by along their common side.
  void bend_over_sides() {
    const ClothLaws& laws = rest_.laws;
    std::vector<std::vector<const Quadratic*>> beside(rest_.sides.size());
    for (const Quadratic& q : seen_)
      for (int k = 3; k < 6; ++k) beside[q.unknown[k]].push_back(&q);
    for (std::size_t s = 0; s < beside.size(); ++s) {
      if (beside[s].size() != 2) continue;
      const auto d = between(rest_, rest_.sides[s][0], rest_.sides[s][1]);
      const Real square = d[0] * d[0] + d[1] * d[1];
      const Real u2 = d[0] * d[0] / square, v2 = d[1] * d[1] / square;
      const Real cross = 2 * d[0] * d[1] / square;
      const auto weight = [&](const Quadratic& q, int k) {
        return u2 * q.uu[k] + cross * q.uv[k] + v2 * q.vv[k];
      };
      Point differ{};
      for (const int side : {0, 1})
        for (int k = 0; k < 6; ++k) {
          const Quadratic& q = *beside[s][side];
          const Point p =
              point_of(k < 3 ? rest_.points_m[q.unknown[k]] : rest_.of_sides[q.unknown[k]]);
          for (int axis = 0; axis < 3; ++axis)
            differ[axis] += (side == 0 ? 1 : -1) * weight(q, k) * p[axis];
        }
      const Real stiffness =
          kOfSide * (beside[s][0]->area + beside[s][1]->area) / 3 *
          (Real(laws.bending[0].slope) * u2 * u2 + Real(laws.bending[1].slope) * v2 * v2 +
           Real(laws.twist_n_m) * cross * cross / 4);
      result_.energy_j += double(stiffness / 2 * checker::dot(differ, differ));
      for (const int side : {0, 1})
        for (int k = 0; k < 6; ++k) {
          const Quadratic& q = *beside[s][side];
          Point& at = (k < 3 ? force_ : moment_)[q.unknown[k]];
          for (int axis = 0; axis < 3; ++axis)
            at[axis] -= (side == 0 ? 1 : -1) * stiffness * weight(q, k) * differ[axis];
        }
    }
  }

  void press() {
    if (!(rest_.layers_apart_m >= 0 && rest_.layers_apart_m <= kThickestCloth_m))
      refuse("layers {:g} mm apart are no contact", rest_.layers_apart_m * 1e3);
    int unknown = 0;
    for (const ContactForce& stated : rest_.contact_forces)
      unknown += surface_->add(*objects_, stated, force_, moment_) ? 0 : 1;
    if (unknown > 0) refuse("{} stated contact forces press on nothing", unknown);
  }

  [[nodiscard]] bool is_held(int i) const {
    if (rest_.scene != nullptr)
      return std::find(rest_.pinned.begin(), rest_.pinned.end(), i) != rest_.pinned.end();
    return rest_.material_m[i].norm() <= rest_.disc_radius_m * (1 + double(kOnDisc));
  }

  /// Held points lie in the plane at their material places, and the sides between them too.
  void hold() {
    Real off = 0, turned = 0;
    for (std::size_t k = 0; k < rest_.pinned.size(); ++k) {
      const Point d =
          minus(point_of(rest_.points_m[rest_.pinned[k]]), point_of(rest_.pinned_in_world[k]));
      off = std::max(off, std::sqrt(checker::dot(d, d)));
    }
    for (std::size_t i = 0; i < rest_.points_m.size(); ++i) {
      if (rest_.scene != nullptr || !is_held(static_cast<int>(i))) continue;
      const Eigen::Vector2d& at = rest_.material_m[i];
      const Point d = minus(point_of(rest_.points_m[i]), {at.x(), at.y(), 0});
      off = std::max(off, std::sqrt(checker::dot(d, d)));
    }
    for (std::size_t s = 0; s < rest_.sides.size(); ++s) {
      const auto [from, to] = rest_.sides[s];
      if (rest_.scene != nullptr || !is_held(from) || !is_held(to)) continue;
      const auto d = between(rest_, from, to);
      const Real length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
      const Point left = minus(point_of(rest_.of_sides[s]), {-d[1] / length, d[0] / length, 0});
      turned = std::max(turned, std::sqrt(checker::dot(left, left)));
    }
    if (off > kHeld_m) refuse("a held point lies {:.3g} mm from its place", double(off) * 1e3);
    if (turned > kHeld_m) refuse("the held cloth is bent by {:.3g}", double(turned));
  }

  void balance() {
    Real total = 0, length = 0;
    const Eigen::Vector3d& g = rest_.gravity_m_per_s2;
    for (const Real m : mass_) total += m;
    for (const auto& [from, to] : rest_.sides) {
      const auto d = between(rest_, from, to);
      length += std::sqrt(d[0] * d[0] + d[1] * d[1]) / static_cast<Real>(rest_.sides.size());
    }
    const Real weight = total * Real(g.norm()) / static_cast<Real>(mass_.size());
    Real points = 0, sides = 0;
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (is_held(static_cast<int>(i))) continue;
      Point f = force_[i];
      for (int axis = 0; axis < 3; ++axis) f[axis] += mass_[i] * Real(g[axis]);
      const Point p = point_of(rest_.points_m[i]);
      if (objects_) f = left_by(*objects_, p, f);
      const Real r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
      // The cylinder pushes outwards, and no other direction.
      if (!objects_ && p[2] < 0 && r > 0 && r <= Real(rest_.disc_radius_m) * (1 + kOnDisc)) {
        const Point out = {p[0] / r, p[1] / r, 0};
        const Real in = std::min<Real>(0, checker::dot(f, out));
        for (int axis = 0; axis < 3; ++axis) f[axis] -= in * out[axis];
      }
      points = std::max(points, std::sqrt(checker::dot(f, f)));
    }
    for (std::size_t s = 0; s < moment_.size(); ++s) {
      const auto [from, to] = rest_.sides[s];
      if (rest_.scene == nullptr && is_held(from) && is_held(to)) continue;
      sides = std::max(sides, std::sqrt(checker::dot(moment_[s], moment_[s])));
    }
    result_.residual = double(points / weight);
    result_.side_residual = double(sides / (weight * length));
    if (!(rest_.residual_tolerance <= kMostResidual))
      refuse("{:.3g} of a point's weight may be left, a rest is at most {:.3g}",
             rest_.residual_tolerance, kMostResidual);
    const double most = rest_.residual_tolerance * (1 + double(kRounding)) + double(kRounding);
    if (!(result_.residual <= most))
      refuse("{:.3g} of a point's weight is left on a point, {:.3g} was claimed", result_.residual,
             rest_.residual_tolerance);
    if (!(result_.side_residual <= most))
      refuse("{:.3g} of a point's weight, over a side's length, is left to turn a side",
             result_.side_residual);
  }

  /// Points may not, cloth between them only as the particle grid's may.
  void enter_objects() {
    Real longest = 0;
    for (const auto& [from, to] : rest_.sides) {
      const auto d = between(rest_, from, to);
      longest = std::max(longest, std::sqrt(d[0] * d[0] + d[1] * d[1]));
    }
    if (!surface_) return;
    const MeshDepths found = surface_->depths(*objects_);
    result_.deepest_m = double(std::max(found.of_points, found.between));
    if (found.of_points > kTouch_m)
      refuse("a point lies {:.3g} mm deep in an object", double(found.of_points) * 1e3);
    if (found.between > std::max(kBetween_m, kBetweenOfSide * longest))
      refuse("the cloth lies {:.3g} mm deep in an object between its points: give a finer mesh",
             double(found.between) * 1e3);
    if (found.through > kThrough)
      refuse("the cloth passes through an object, {:.2g} of its thickness deep",
             double(found.through));
  }

  /// Cloth in the cylinder that the discs end: points, and sides between them.
  void enter() {
    if (objects_) return enter_objects();
    const Real disc = rest_.disc_radius_m;
    Real deepest = 0, longest = 0;
    for (const auto& [from, to] : rest_.sides) {
      if (is_held(from) && is_held(to)) continue;
      const Point a = point_of(rest_.points_m[from]), d = minus(point_of(rest_.points_m[to]), a);
      longest = std::max(longest, checker::dot(d, d));
      const Real flat = d[0] * d[0] + d[1] * d[1];
      const Real at = flat > 0 ? std::clamp<Real>(-(a[0] * d[0] + a[1] * d[1]) / flat, 0, 1) : 0;
      const Real x = a[0] + at * d[0], y = a[1] + at * d[1];
      deepest = std::max(deepest, disc - std::sqrt(x * x + y * y));
    }
    result_.deepest_m = double(deepest);
    const Real allowed = longest / (8 * disc) + kOnDisc * disc;
    if (deepest > allowed)
      refuse("the cloth lies {:.3g} mm deep in the discs' cylinder", double(deepest) * 1e3);
  }

  const MeshRest& rest_;
  std::optional<Objects> objects_;
  std::optional<MeshSurface> surface_;
  std::map<std::array<int, 2>, int> side_at_;
  std::vector<Point> force_, moment_;
  std::vector<Real> mass_;
  std::vector<Quadratic> seen_;
  Real over_limit_ = 0;
  MeshJudgement result_;
};

}  // namespace

MeshJudgement judge_mesh(const MeshRest& rest) {
  return Judge(rest).judge();
}

}  // namespace drape::simulate

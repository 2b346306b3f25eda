// SPDX-License-Identifier: Apache-2.0
#include "simulate/checker/certify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/units.hpp"
#include "simulate/checker/surface.hpp"
#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {
namespace {

namespace fs = std::filesystem;
using units::mm;

using namespace checker;

/// A number with its derivatives by the coordinates of an element.
template <int N>
struct Dual {
  Real v = 0;
  Eigen::Matrix<Real, N, 1> d = Eigen::Matrix<Real, N, 1>::Zero();
};

template <int N>
Dual<N> chain(const Dual<N>& x, Real value, Real slope) {
  return {value, slope * x.d};
}
template <int N>
Dual<N> operator+(const Dual<N>& a, const Dual<N>& b) {
  return {a.v + b.v, a.d + b.d};
}
template <int N>
Dual<N> operator*(Real s, const Dual<N>& a) {
  return chain(a, s * a.v, s);
}
template <int N>
Dual<N> operator-(const Dual<N>& a, const Dual<N>& b) {
  return a + Real(-1) * b;
}
template <int N>
Dual<N> operator*(const Dual<N>& a, const Dual<N>& b) {
  return {a.v * b.v, a.v * b.d + b.v * a.d};
}
template <int N>
Dual<N> root(const Dual<N>& a) {
  const Real r = std::sqrt(a.v);
  return chain(a, r, r > 0 ? 1 / (2 * r) : 0);
}

template <int N>
using Vector = std::array<Dual<N>, 3>;

/// Weighted sum of an element's points, with derivatives by their coordinates.
template <int N>
Vector<N> combine(const std::array<std::array<Real, 3>, N / 3>& places,
                  const std::vector<Real>& weights) {
  Vector<N> sum;
  for (std::size_t c = 0; c < places.size(); ++c)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum[axis].v += weights[c] * places[c][axis];
      sum[axis].d[3 * c + axis] = weights[c];
    }
  return sum;
}
template <int N>
Dual<N> dot(const Vector<N>& a, const Vector<N>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Real law_value(const ForceCurve& law, Real x) {
  Real f = Real(law.slope) * x;
  for (const auto& hinge : law.hinges) {
    if (x > hinge.at) f += Real(hinge.change) * (x - Real(hinge.at));
  }
  return f;
}

Real law_work(const ForceCurve& law, Real x) {
  Real w = Real(law.slope) * x * x / 2;
  for (const auto& hinge : law.hinges) {
    const Real over = x - Real(hinge.at);
    if (over > 0) w += Real(hinge.change) * over * over / 2;
  }
  return w;
}

template <int N>
Dual<N> work_under(const ForceCurve& law, const Dual<N>& x) {
  return chain(x, law_work(law, x.v), law_value(law, x.v));
}

/// Energy and force of friction elements, each from its own slip. Raises `over_limit` to 1 plus
/// the largest excess of an element over its limit, relative to the sum of the limits, if that is
/// more.
template <int N>
Dual<N> slipped(const FrictionStack& stack, const std::vector<double>& memory, int place,
                const Dual<N>& x, Real& over_limit) {
  constexpr Real kNoStrain = 1e-6L;  // rad or 1/m; flat within rounding
  Dual<N> sum;
  const auto count = static_cast<int>(stack.elements.size());
  Real whole = 0;  // sum of the limits, since a single one may be zero at this strain
  for (const SlipElement& element : stack.elements)
    whole += Real(element.threshold) + Real(element.growth) * std::abs(x.v) +
             Real(element.stiffness) * kNoStrain;
  for (int k = 0; k < count; ++k) {
    const SlipElement& element = stack.elements[k];
    const Real over = x.v - Real(memory[place * count + k]);
    const Real stiffness = element.stiffness;
    const Real most = Real(element.threshold) + Real(element.growth) * std::abs(x.v);
    const Real pull = std::abs(stiffness * over);
    over_limit = std::max(over_limit, 1 + (pull - most) / whole);
    sum = sum + chain(x, stiffness * over * over / 2, stiffness * over);
  }
  return sum;
}

using CornerJet = Dual<9>;  // derivatives by the corners of a triangle only
using CornerPlace = Vector<9>;
using MetricJet = Dual<3>;  // derivatives by |x_u|^2, x_u . x_v, |x_v|^2

template <int N>
Dual<N> inverse_root(const Dual<N>& square) {
  const Real size = std::sqrt(square.v);
  return chain(square, 1 / size, -1 / (2 * size * square.v));
}

/// Difference (warp, weft) of the material coordinates of two points.
std::array<Real, 2> between(const MeshRest& rest, int from, int to) {
  const Eigen::Vector2d &a = rest.shape.material_m[from], &b = rest.shape.material_m[to];
  return {Real(b.x()) - Real(a.x()), Real(b.y()) - Real(a.y())};
}

/// Metric of a triangle, from its corners.
struct Metric {
  Real area;
  std::array<CornerJet, 3> of;
};
Metric metric_of(const MeshRest& rest, int t) {
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
Membrane membrane_of(const ClothLaws& laws, const std::array<Real, 3>& metric) {
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

using Jet = Dual<18>;  // derivatives by corners and edges of a triangle
using Place = Vector<18>;
constexpr Real kOnDisc = 1e-5L;  // relative to the radius; nearer to the rim, a point is on it
/// Largest residual accepted of a cloth at rest, in weights of a point, whatever it claims.
constexpr double kMostResidual = 1e-3;
constexpr double kThickestCloth_m = 0.01;
constexpr Real kOnLine_m = 2e-6L;    // m, in material coordinates; rounding in files
constexpr Real kHeldSlope = 1e-7L;   // difference of a held slope: the ends of a clamp are rounded
constexpr Real kRounding = 1e-6L;    // relative to a force, between double and long double
constexpr Real kOverLimit = 1e-6L;   // relative to the limit of a friction element
constexpr Real kOfTriangle = 0.05L;  // share of stretch and shear by triangle, the rest by point
constexpr Real kOfSide = 2;          // weight of the bending term at edges between two triangles

class Judge {
 public:
  explicit Judge(const MeshRest& rest) : rest_(rest) {
    if (rest.scene != nullptr) objects_.emplace(*rest.scene);
  }

  MeshJudgement judge() {
    if (!fits()) return std::move(result_);
    force_.assign(rest_.shape.points_m.size(), Point{});
    moment_.assign(rest_.shape.sides.size(), Point{});
    mass_.assign(rest_.shape.points_m.size(), 0);
    for (std::size_t t = 0; t < rest_.shape.triangles.size(); ++t) add(static_cast<int>(t));
    if (result_.refusals.empty()) {
      stretch();
      bend_over_sides();
    }
    for (int d = 0; d < 2; ++d)
      if (result_.strains.most[d] > rest_.most_strain[d])
        refuse("{} is strained by {:.3g} %, {:.3g} % are believed: it was measured to half of that",
               d == 0 ? "warp" : "weft", result_.strains.most[d] * 100, rest_.most_strain[d] * 100);
    if (over_limit_ > 1 + kOverLimit)
      refuse("a friction element bears {:.2g} of its limit", double(over_limit_));
    if (seen_.size() == rest_.shape.triangles.size()) {
      surface_.emplace(rest_, seen_);
      for (const Eigen::Vector2d& asked : rest_.asked_m)
        result_.places.push_back(surface_->place(asked));
    }
    hold();
    if (objects_ && surface_) press();
    balance();
    enter();
    if (surface_) result_.crossings = surface_->crossings();
    if (result_.crossings > 0)
      refuse("the cloth passes through itself in {} places", result_.crossings);
    return std::move(result_);
  }

 private:
  template <class... Values>
  void refuse(fmt::format_string<Values...> text, Values&&... values) {
    result_.refusals.push_back(fmt::format(text, std::forward<Values>(values)...));
  }

  /// True if sizes and indices are consistent and all numbers finite.
  bool fits() {
    const auto count = static_cast<int>(rest_.shape.points_m.size());
    bool fit = rest_.shape.material_m.size() == rest_.shape.points_m.size() &&
               rest_.shape.sides.size() == rest_.shape.of_sides.size() && count > 2;
    for (const Eigen::Vector3d& p : rest_.shape.points_m) fit = fit && p.allFinite();
    for (const Eigen::Vector3d& p : rest_.shape.of_sides) fit = fit && p.allFinite();
    for (std::size_t s = 0; fit && s < rest_.shape.sides.size(); ++s) {
      const auto [from, to] = rest_.shape.sides[s];
      fit = from >= 0 && from < to && to < count &&
            side_at_.emplace(rest_.shape.sides[s], static_cast<int>(s)).second;
    }
    for (std::size_t t = 0; fit && t < rest_.shape.triangles.size(); ++t)
      for (int k = 0; k < 3 && fit; ++k) {
        const int a = rest_.shape.triangles[t][(k + 1) % 3],
                  b = rest_.shape.triangles[t][(k + 2) % 3];
        fit = side_at_.contains({std::min(a, b), std::max(a, b)});
      }
    if (fit && rest_.laws.friction) {
      const ClothFriction& friction = *rest_.laws.friction;
      const std::size_t triangles = rest_.shape.triangles.size();
      for (int d = 0; d < 2; ++d)
        fit &= rest_.memory.bending[d].size() == triangles * friction.bending[d].elements.size();
      fit &=
          rest_.memory.shear.size() == rest_.shape.points_m.size() * friction.shear.elements.size();
    }
    if (!fit) refuse("points, sides and triangles do not fit each other");
    return fit;
  }

  void add(int t) {
    const std::array<int, 3>& corner = rest_.shape.triangles[t];
    const auto first = between(rest_, corner[0], corner[1]),
               second = between(rest_, corner[0], corner[2]);
    const Real area = (first[0] * second[1] - first[1] * second[0]) / 2;
    if (!(area > 0)) {
      refuse("triangle {} has no area or is turned over", t);
      return;
    }
    // Weights of corners 0 .. 2 and edges 3 .. 5 in the derivatives.
    std::vector<Real> u(6), v(6), uu(6), uv(6), vv(6);
    std::array<int, 6> unknown{};
    for (int k = 0; k < 3; ++k) {
      const int a = (k + 1) % 3, b = (k + 2) % 3, from = corner[a], to = corner[b];
      const auto d = between(rest_, from, to);
      const Real length = std::sqrt(d[0] * d[0] + d[1] * d[1]);
      const std::array<Real, 2> out = {d[1], -d[0]};  // outward normal times length
      // The midpoint of an edge has the mean position of its ends ...
      for (const int c : {a, b}) {
        u[c] += out[0] / (2 * area);
        v[c] += out[1] / (2 * area);
      }
      // ... a gradient along the edge from its ends, and across it from the edge's own derivative.
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
    std::array<Point, 6> places;
    for (int k = 0; k < 6; ++k)
      places[k] =
          point_of(k < 3 ? rest_.shape.points_m[unknown[k]] : rest_.shape.of_sides[unknown[k]]);
    seen_.push_back({area, unknown, uu, uv, vv});
    const auto jet = [&](const std::vector<Real>& weights) { return combine<18>(places, weights); };
    const Jet energy = area * bending_of(t, jet(u), jet(v), jet(uu), jet(uv), jet(vv));
    result_.energy_j += double(energy.v);
    for (int k = 0; k < 6; ++k)
      for (int axis = 0; axis < 3; ++axis)
        (k < 3 ? force_ : moment_)[unknown[k]][axis] -= energy.d[3 * k + axis];
  }

  /// Bending energy per area from the second derivatives of the position.
  Jet bending_of(int t, const Place& x_u, const Place& x_v, const Place& x_uu, const Place& x_uv,
                 const Place& x_vv) {
    const ClothLaws& laws = rest_.laws;
    const Jet warp = root(dot(x_uu, x_uu)), weft = root(dot(x_vv, x_vv));
    double& most = result_.strains.curvature_most_per_m;
    most = std::max({most, double(warp.v), double(weft.v)});
    Jet sum = work_under(laws.bending[0], warp) + work_under(laws.bending[1], weft) +
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

  /// Energy of stretch and shear: mostly at the points, from the mean metric of the surrounding
  /// triangles; a small share in the triangles.
  void stretch() {
    std::vector<Metric> metric;
    std::vector<Real> area(rest_.shape.points_m.size(), 0);
    std::vector<std::array<Real, 3>> mean(rest_.shape.points_m.size());
    std::vector<Eigen::Matrix<Real, 3, 1>> stress(mean.size(), Eigen::Matrix<Real, 3, 1>::Zero());
    for (std::size_t t = 0; t < rest_.shape.triangles.size(); ++t) {
      metric.push_back(metric_of(rest_, static_cast<int>(t)));
      for (const int i : rest_.shape.triangles[t]) {
        area[i] += metric[t].area / 3;
        for (int k = 0; k < 3; ++k) mean[i][k] += metric[t].area / 3 * metric[t].of[k].v;
      }
    }
    for (std::size_t i = 0; i < mean.size(); ++i) {
      if (!(area[i] > 0)) continue;
      for (Real& m : mean[i]) m /= area[i];
      const Membrane found = membrane_of(rest_.laws, mean[i]);
      MeshStrains& strains = result_.strains;
      const Eigen::Vector2d strain(double(std::sqrt(mean[i][0]) - 1),
                                   double(std::sqrt(mean[i][2]) - 1));
      strains.least = strains.least.cwiseMin(strain);
      strains.most = strains.most.cwiseMax(strain);
      strains.shear_most_rad = std::max(strains.shear_most_rad, std::abs(double(found.angle.v)));
      MetricJet energy = (1 - kOfTriangle) * found.energy;
      if (rest_.laws.friction)
        energy = energy + slipped(rest_.laws.friction->shear, rest_.memory.shear,
                                  static_cast<int>(i), found.angle, over_limit_);
      result_.energy_j += double(area[i] * energy.v);
      stress[i] = energy.d;
    }
    for (std::size_t t = 0; t < metric.size(); ++t) {
      const std::array<int, 3>& corner = rest_.shape.triangles[t];
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

  /// Bending energy of the difference between two quadratics along their common edge.
  void bend_over_sides() {
    const ClothLaws& laws = rest_.laws;
    std::vector<std::vector<const Quadratic*>> beside(rest_.shape.sides.size());
    for (const Quadratic& q : seen_)
      for (int k = 3; k < 6; ++k) beside[q.unknown[k]].push_back(&q);
    for (std::size_t s = 0; s < beside.size(); ++s) {
      if (beside[s].size() != 2) continue;
      const auto d = between(rest_, rest_.shape.sides[s][0], rest_.shape.sides[s][1]);
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
          const Point p = point_of(k < 3 ? rest_.shape.points_m[q.unknown[k]]
                                         : rest_.shape.of_sides[q.unknown[k]]);
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
    result_.places_pressed = static_cast<int>(rest_.contact_forces.size());
    for (const ContactForce& stated : rest_.contact_forces)
      unknown += surface_->add(*objects_, stated, force_, moment_) ? 0 : 1;
    if (unknown > 0) refuse("{} stated contact forces press on nothing", unknown);
    if (surface_->deepest_pressed() > kSunk_m)
      refuse("a place that is pressed lies {:.3g} mm deep in an object",
             double(surface_->deepest_pressed()) * 1e3);
    if (const auto& nearest = surface_->nearest_layers()) result_.to_itself_m = double(*nearest);
  }

  /// Records a held point and its distance from its target.
  void hold_point(std::size_t i, const Point& place) {
    held_[i] = true;
    const Real off = length(minus(point_of(rest_.shape.points_m[i]), place));
    result_.hold_error_m = std::max(result_.hold_error_m, double(off));
  }
  void hold_side(std::size_t s, const Point& slope) {
    held_side_[s] = true;
    turned_ = std::max(turned_, length(minus(point_of(rest_.shape.of_sides[s]), slope)));
  }

  void hold() {
    held_.assign(rest_.shape.points_m.size(), false);
    held_side_.assign(rest_.shape.sides.size(), false);
    if (rest_.scene == nullptr) {
      hold_disc();
    } else {
      for (const HeldPoint& pin : rest_.pins) hold_pin(pin);
      for (const Clamp& clamp : rest_.scene->clamps) hold_clamp(clamp);
    }
    if (result_.hold_error_m > kRounding_m)
      refuse("a held point lies {:.3g} mm from its place", result_.hold_error_m * 1e3);
    if (turned_ > kHeldSlope) refuse("the held cloth is bent by {:.3g}", double(turned_));
  }

  /// Holds points and the edges between them in the plane, at their material coordinates.
  void hold_disc() {
    for (std::size_t i = 0; i < held_.size(); ++i) {
      const Eigen::Vector2d& at = rest_.shape.material_m[i];
      if (at.norm() <= rest_.disc_radius_m * (1 + double(kOnDisc)))
        hold_point(i, {at.x(), at.y(), 0});
    }
    for (std::size_t s = 0; s < held_side_.size(); ++s) {
      const auto [from, to] = rest_.shape.sides[s];
      if (!held_[from] || !held_[to]) continue;
      const std::array<Real, 2> left = left_of(s);
      hold_side(s, {left[0], left[1], 0});
    }
  }

  void hold_pin(const HeldPoint& pin) {
    std::size_t nearest = 0;
    const auto off = [&](std::size_t i) {
      return (rest_.shape.material_m[i] - pin.material_m).norm();
    };
    for (std::size_t i = 1; i < held_.size(); ++i)
      if (off(i) < off(nearest)) nearest = i;
    if (!(off(nearest) <= double(kOnLine_m)))
      return refuse("no point of the mesh is where a pin holds the cloth");
    hold_point(nearest, point_of(pin.place.value_or(rest_.shape.points_m[nearest])));
  }

  /// Holds the points of a clamp's line on its line in space. The edges take the clamp's slope:
  /// towards larger coordinates, unless all adjacent cloth has smaller ones.
  void hold_clamp(const Clamp& clamp) {
    const Point from = point_of(clamp.from_in_world), to = point_of(clamp.to_in_world);
    const Eigen::Vector2d first = clamp.from_material_m, line = clamp.to_material_m - first;
    const int across = std::abs(line.x()) < std::abs(line.y()) ? 0 : 1;
    const Real extent = Real(line[1 - across]);
    if (!(std::abs(line[across]) < kOnLine_m && std::abs(extent) > kOnLine_m &&
          length(minus(to, from)) > kOnLine_m))
      return refuse("a clamp runs along no thread or has no length");
    const Point along = times(1 / length(minus(to, from)), minus(to, from));
    const Point out = point_of(clamp.direction_in_world);
    const Point leaving = plus(out, along, -checker::dot(out, along));
    if (!(length(leaving) > 0)) return refuse("a clamp is left along itself");
    const auto part = [&](int i) {
      return (Real(rest_.shape.material_m[i][1 - across]) - first[1 - across]) / extent;
    };
    std::vector<bool> on_line(held_.size(), false);
    int found = 0;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      const Real beyond = kOnLine_m / std::abs(extent), at = part(static_cast<int>(i));
      on_line[i] = std::abs(rest_.shape.material_m[i][across] - first[across]) < kOnLine_m &&
                   at > -beyond && at < 1 + beyond;
      if (!on_line[i]) continue;
      ++found;
      hold_point(i, plus(from, minus(to, from), at));
    }
    if (found < 2) return refuse("a clamp holds no points of the mesh");
    bool far_hem = true;
    for (const std::array<int, 3>& corner : rest_.shape.triangles) {
      bool at_line = false, beyond = false;
      for (const int i : corner) {
        at_line = at_line || on_line[i];
        beyond = beyond || rest_.shape.material_m[i][across] > first[across] + double(kOnLine_m);
      }
      far_hem = far_hem && !(at_line && beyond);
    }
    const Point slope = times((far_hem ? -1 : 1) / length(leaving), leaving);
    for (std::size_t s = 0; s < held_side_.size(); ++s) {
      const auto [a, b] = rest_.shape.sides[s];
      if (on_line[a] && on_line[b]) hold_side(s, times(left_of(s)[across], slope));
    }
  }

  /// Unit vector in material coordinates towards an edge's left.
  [[nodiscard]] std::array<Real, 2> left_of(std::size_t s) const {
    const auto d = between(rest_, rest_.shape.sides[s][0], rest_.shape.sides[s][1]);
    const Real size = std::sqrt(d[0] * d[0] + d[1] * d[1]);
    return {-d[1] / size, d[0] / size};
  }

  void balance() {
    Real total = 0, length = 0;
    const Eigen::Vector3d& g = rest_.gravity_m_per_s2;
    for (const Real m : mass_) total += m;
    for (const auto& [from, to] : rest_.shape.sides) {
      const auto d = between(rest_, from, to);
      length += std::sqrt(d[0] * d[0] + d[1] * d[1]) / static_cast<Real>(rest_.shape.sides.size());
    }
    const Real weight = total * Real(g.norm()) / static_cast<Real>(mass_.size());
    Real points = 0, sides = 0;
    for (std::size_t i = 0; i < force_.size(); ++i) {
      if (held_[i]) continue;
      Point f = plus(force_[i], point_of(g), mass_[i]);
      const Point p = point_of(rest_.shape.points_m[i]);
      const Real r = std::sqrt(p[0] * p[0] + p[1] * p[1]);
      // The cylinder can only push outwards.
      if (!objects_ && p[2] < 0 && r > 0 && r <= Real(rest_.disc_radius_m) * (1 + kOnDisc)) {
        const Point out = {p[0] / r, p[1] / r, 0};
        const Real in = std::min<Real>(0, checker::dot(f, out));
        f = plus(f, out, -in);
      }
      points = std::max(points, checker::length(f));
    }
    for (std::size_t s = 0; s < moment_.size(); ++s)
      if (!held_side_[s]) sides = std::max(sides, checker::length(moment_[s]));
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

  void enter_objects() {
    if (!surface_) return;
    const MeshDepths found = surface_->depths(*objects_, held_);
    result_.deepest_m = double(found.deepest);
    if (found.to_object) result_.to_object_m = double(*found.to_object);
    result_.to_table_m = double(found.to_table);
    if (found.over > 0)
      refuse("the cloth lies {:.3g} mm deep in an object, {:.3g} mm more than it may",
             double(found.deepest) * 1e3, double(found.over) * 1e3);
    if (found.through > kThrough)
      refuse("the cloth passes through an object, {:.2g} of its thickness deep",
             double(found.through));
  }

  /// Refuses a drape whose vertices or edges enter the discs' cylinder, or the scene's objects.
  void enter() {
    if (objects_) return enter_objects();
    const Real disc = rest_.disc_radius_m;
    Real deepest = 0, longest = 0;
    for (const auto& [from, to] : rest_.shape.sides) {
      if (held_[from] && held_[to]) continue;
      const Point a = point_of(rest_.shape.points_m[from]),
                  d = minus(point_of(rest_.shape.points_m[to]), a);
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
  std::vector<bool> held_, held_side_;
  Real over_limit_ = 0, turned_ = 0;
  MeshJudgement result_;
};

constexpr double kEnergyFraction = 1e-6;    // relative to the internal energy
constexpr double kStrainAllowed = 1e-9;     // rounding
constexpr double kShearAllowed_rad = 1e-6;  // last digit of a sine near 90 degrees: 1.5e-8 rad
constexpr double kCurvatureAllowed_per_m = 1e-6;  // last digits of a metre over (1 mm)^2: 1e-10
constexpr double kTwistFraction = 1e-9;           // relative to the twist stiffness
constexpr double kPlaceAllowed_m = 1e-6;  // tolerance of distances, and of the sheet on the surface
constexpr double kMostOfMeasured = 2;  // beyond this, more of a curve is extrapolated than measured

void compare(CertifyReport& report, const std::string& what, double claimed, double found,
             double allowed) {
  report.lines.push_back({what, claimed, found, allowed, false});
}

void compare_strains(CertifyReport& report, const Certificate& claim, const MeshStrains& found) {
  if (!claim.strains) return;
  compare(report, "largest shear (rad)", claim.strains->shear_most_rad, found.shear_most_rad,
          kShearAllowed_rad);
  compare(report, "largest curvature (1/m)", claim.strains->curvature_most_per_m,
          found.curvature_most_per_m, kCurvatureAllowed_per_m);
  for (int d = 0; d < 2; ++d) {
    const std::string thread = d == 0 ? "warp" : "weft";
    const Eigen::Vector2d& claimed = d == 0 ? claim.strains->warp : claim.strains->weft;
    compare(report, "least " + thread + " strain", claimed[0], found.least[d], kStrainAllowed);
    compare(report, "largest " + thread + " strain", claimed[1], found.most[d], kStrainAllowed);
  }
}

void compare_numbers(CertifyReport& report, const Certificate& claim, const ClothLaws& laws,
                     const MeshJudgement& found) {
  compare_strains(report, claim, found.strains);
  compare(report, "twist stiffness (N m)", claim.twist_n_m, laws.twist_n_m,
          kTwistFraction * laws.twist_n_m);
  if (claim.energies && claim.energies->internal_j)
    compare(report, "internal energy (J)", *claim.energies->internal_j, found.energy_j,
            kEnergyFraction * found.energy_j);
  if (claim.distances) {
    const CertificateDistances& distances = *claim.distances;
    if (distances.to_object_m && found.to_object_m)
      compare(report, "least distance to an object (m)", *distances.to_object_m, *found.to_object_m,
              kPlaceAllowed_m);
    compare(report, "least distance to the table (m)", distances.to_table_m, found.to_table_m,
            kPlaceAllowed_m);
    if (claim.at_rest)
      compare(report, "deepest in an object (m)", distances.deepest_m, found.deepest_m,
              kPlaceAllowed_m);
  }
  if (claim.at_rest)
    report.lines.push_back({"residual force (of a point's weight)", claim.residual.value_or(1),
                            found.residual, claim.residual_tolerance, true});
}

/// Largest distance (m) of the sheet's points from their positions on the cloth.
double off_cloth_m(const Sheet& sheet, const MeshJudgement& found, CertifyReport& report) {
  double farthest = 0;
  for (std::size_t i = 0; i < found.places.size(); ++i) {
    const SheetMark& mark = sheet.marks[i];
    if (found.places[i]) {
      farthest = std::max(farthest, (*found.places[i] - mark.point_in_world).norm());
      continue;
    }
    report.refusals.push_back(fmt::format("mark ({}, {}) of the sheet lies beside the cloth",
                                          mark.mark.row, mark.mark.col));
    break;
  }
  return farthest;
}

/// Checks that sheet, certificate and print belong to the same cloth.
void compare_sheet(CertifyReport& report, const RestFiles& files, const Print& print,
                   const MeshJudgement& found) {
  const auto refuse = [&](std::string text) { report.refusals.push_back(std::move(text)); };
  const auto* source = std::get_if<SimulatedSource>(&files.sheet.source);
  if (source == nullptr) return refuse("the sheet is a measured one");
  if ((source->status == "at rest") != files.certificate.at_rest)
    refuse(fmt::format("the sheet says `{}`, the certificate `{}`", source->status,
                       files.certificate.status));
  if (source->segments != files.certificate.segments)
    refuse("sheet and certificate state other numbers of segments");
  if (!((files.sheet.patch_m - print.patch_m).cwiseAbs().maxCoeff() <= kPlaceAllowed_m))
    refuse(fmt::format("the sheet is of a patch of {:g} x {:g} mm, the print has {:g} x {:g} mm",
                       files.sheet.patch_m.x() / mm, files.sheet.patch_m.y() / mm,
                       print.patch_m.x() / mm, print.patch_m.y() / mm));
  report.lines.push_back({"distance of the sheet from the cloth (m)", 0,
                          off_cloth_m(files.sheet, found, report), kPlaceAllowed_m, true});
}

std::vector<HeldPoint> pins_of(const Scene& scene, const Print& print,
                               const std::optional<Sheet>& measured) {
  std::vector<HeldPoint> pins;
  for (const Pin& pin : scene.pins) {
    pins.push_back({pin.material_m(print), pin.point_in_world});
    if (pin.point_in_world || !measured) continue;
    if (const SheetMark* mark = measured->find(pin.mark)) pins.back().place = mark->point_in_world;
  }
  return pins;
}

}  // namespace

MeshJudgement judge_mesh(const MeshRest& rest) {
  return Judge(rest).judge();
}

bool CertifyLine::passes() const {
  return is_limit ? found <= allowed : std::abs(claimed - found) <= allowed;
}

bool CertifyReport::accepted() const {
  return refusals.empty() && std::all_of(lines.begin(), lines.end(),
                                         [](const CertifyLine& line) { return line.passes(); });
}

RestFiles read_rest_files(const fs::path& folder) {
  RestFiles files;
  const fs::path certificate = folder / "certificate.json", forces = folder / "contact_forces.csv";
  files.certificate = read_certificate(certificate);
  if (!std::holds_alternative<CertificateMesh>(files.certificate.cloth))
    throw bad_input("the drape is of the paper's model, which its own residual forces judge",
                    {.file = certificate.string(), .field = "/options/cloth"},
                    "give the folder of a drape without --paper");
  files.sheet = read_sheet(folder / "sheet.ply");
  files.shape = read_cloth_shape(folder / "cloth.ply");
  files.files = {folder / "sheet.ply", folder / "sheet.json", certificate, folder / "cloth.ply"};
  if (files.certificate.internal_friction) {
    files.files.push_back(folder / "memory.csv");
    files.memory = read_memory(files.files.back());
  }
  const int stated = files.certificate.distances ? files.certificate.distances->contact_forces : 0;
  if (stated == 0) return files;
  files.files.push_back(forces);
  files.contact_forces = read_contact_forces(forces);
  if (files.contact_forces.size() != static_cast<std::size_t>(stated))
    throw bad_input(fmt::format("{} contact forces, the certificate states {}",
                                files.contact_forces.size(), stated),
                    {.file = forces.string()}, "simulate the drape again");
  return files;
}

Eigen::Vector2d strain_limits(const Fabric& fabric) {
  return kMostOfMeasured * Eigen::Vector2d(fabric.tensile[0].x.back(), fabric.tensile[1].x.back());
}

CertifyReport certify(const RestFiles& files, const Scene& scene, const Fabric& fabric,
                      const Print& print, const std::optional<Sheet>& measured) {
  const Certificate& claim = files.certificate;
  Scene judged_in = scene;
  judged_in.friction = claim.friction;
  MeshRest rest;
  rest.shape = files.shape;
  rest.laws = fit_laws(fabric, claim.segments, claim.reach, claim.internal_friction).laws;
  rest.memory = files.memory;
  rest.scene = &judged_in;
  rest.pins = pins_of(scene, print, measured);
  rest.contact_forces = files.contact_forces;
  if (claim.distances) rest.layers_apart_m = claim.distances->layers_apart_m.value_or(0);
  rest.gravity_m_per_s2 = scene.gravity_m_per_s2;
  rest.residual_tolerance = claim.residual_tolerance;
  rest.most_strain = strain_limits(fabric);
  for (const SheetMark& mark : files.sheet.marks) rest.asked_m.push_back(mark.material_m);
  const MeshJudgement found = judge_mesh(rest);
  CertifyReport report;
  if (claim.at_rest) report.refusals = found.refusals;
  compare_numbers(report, claim, rest.laws, found);
  compare_sheet(report, files, print, found);
  if (claim.friction != scene.friction)
    report.warnings.push_back(
        fmt::format("judged with the friction {:g} of the certificate, the "
                    "scene has {:g}",
                    claim.friction, scene.friction));
  return report;
}

}  // namespace drape::simulate

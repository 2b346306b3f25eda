// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/layer_pair.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Places = std::array<Vector3d, 4>;

constexpr double kParallelEdges = 1e-10;  // squared sine below which edges are parallel
constexpr double kNearly = 0.1;  // an advance ends at this fraction of the remaining distance
constexpr int kAdvances = 200;
constexpr double kNearest = 1e-6;     // smallest distance for the law, relative to the thickness
constexpr double kSmooth = 1e-3;      // squared sine from which edges have full weight
constexpr double kBeyond = 1 + 1e-9;  // relative to a reach; excludes contact despite rounding

Places places_of(const LayerPair& pair, const Nodes& position) {
  Places p;
  for (int k = 0; k < 4; ++k) p[k] = position[pair.node[k]];
  return p;
}

/// Parameter, 0 at a and 1 at b, of the point on the segment nearest to p.
double along(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d edge = b - a;
  const double length2 = edge.squaredNorm();
  return length2 > 0 ? std::clamp((p - a).dot(edge) / length2, 0.0, 1.0) : 0.0;
}

void add_slide(NearestPoints& nearest, const std::array<double, 4>& slide) {
  nearest.slide[nearest.slides++] = slide;
}

void set_apart(NearestPoints& nearest, const Places& p) {
  nearest.apart.setZero();
  for (int k = 0; k < 4; ++k) nearest.apart += nearest.weight[k] * p[k];
}

NearestPoints of_triangle(const Places& p) {
  NearestPoints nearest;
  const Vector3d u = p[2] - p[1], v = p[3] - p[1], w = p[0] - p[1];
  const Vector3d normal = u.cross(v);
  const double area2 = normal.squaredNorm();
  if (area2 > 0) {
    const double s = w.cross(v).dot(normal) / area2, t = u.cross(w).dot(normal) / area2;
    if (s >= 0 && t >= 0 && s + t <= 1) {
      nearest.weight = {1, s + t - 1, -s, -t};
      add_slide(nearest, {0, 1, -1, 0});
      add_slide(nearest, {0, 1, 0, -1});
      set_apart(nearest, p);
      return nearest;
    }
  }
  double least = 0;
  for (int k = 0; k < 3; ++k) {
    const int a = 1 + k, b = 1 + (k + 1) % 3;
    const double t = along(p[0], p[a], p[b]);
    NearestPoints other;
    other.weight[0] = 1;
    other.weight[a] = t - 1;
    other.weight[b] = -t;
    set_apart(other, p);
    const double size = other.apart.squaredNorm();
    if (k > 0 && size >= least) continue;
    least = size;
    nearest = other;
    if (t <= 0 || t >= 1) continue;
    std::array<double, 4> slide{};
    slide[a] = 1;
    slide[b] = -1;
    add_slide(nearest, slide);
  }
  return nearest;
}

constexpr std::array<double, 4> kAlongFirst{-1, 1, 0, 0}, kAlongSecond{0, 0, 1, -1};

NearestPoints of_edges(const Places& p) {
  NearestPoints nearest;
  const Vector3d u = p[1] - p[0], v = p[3] - p[2], w = p[0] - p[2];
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double det = uu * vv - uv * uv;
  if (det > kParallelEdges * uu * vv) {
    const double s = (uv * v.dot(w) - vv * u.dot(w)) / det;
    const double t = (uu * v.dot(w) - uv * u.dot(w)) / det;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) {
      nearest.weight = {1 - s, s, t - 1, -t};
      add_slide(nearest, kAlongFirst);
      add_slide(nearest, kAlongSecond);
      set_apart(nearest, p);
      return nearest;
    }
  }
  double least = 0;
  for (int end = 0; end < 4; ++end) {
    const bool first = end < 2;  // edge that the end belongs to
    const double here = end % 2;
    const double there = first ? along(p[end], p[2], p[3]) : along(p[end], p[0], p[1]);
    const double s = first ? here : there, t = first ? there : here;
    NearestPoints other;
    other.weight = {1 - s, s, t - 1, -t};
    set_apart(other, p);
    const double size = other.apart.squaredNorm();
    if (end > 0 && size >= least) continue;
    least = size;
    nearest = other;
    if (there > 0 && there < 1) add_slide(nearest, first ? kAlongSecond : kAlongFirst);
  }
  return nearest;
}

NearestPoints nearest_of(const LayerPair& pair, const Places& p) {
  return pair.edges ? of_edges(p) : of_triangle(p);
}

}  // namespace

NearestPoints nearest_points(const LayerPair& pair, const Nodes& position) {
  return nearest_of(pair, places_of(pair, position));
}

/// Second derivative of f(x, q), half the squared distance with weights linear in q, where q
/// minimises f: f_xx - f_xq f_qq^-1 f_qx.
Eigen::Matrix<double, 12, 12> distance_curvature(const LayerPair& pair,
                                                 const NearestPoints& nearest,
                                                 const Nodes& position) {
  const Places p = places_of(pair, position);
  Eigen::Matrix<double, 12, 12> all;
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l < 4; ++l)
      all.block<3, 3>(3 * k, 3 * l) =
          nearest.weight[k] * nearest.weight[l] * Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix<double, 12, 2> mixed = Eigen::Matrix<double, 12, 2>::Zero();
  Eigen::Matrix<double, 3, 2> directions = Eigen::Matrix<double, 3, 2>::Zero();
  for (int a = 0; a < nearest.slides; ++a) {
    for (int k = 0; k < 4; ++k) directions.col(a) += nearest.slide[a][k] * p[k];
  }
  for (int a = 0; a < nearest.slides; ++a) {
    for (int k = 0; k < 4; ++k)
      mixed.block<3, 1>(3 * k, a) =
          nearest.slide[a][k] * nearest.apart + nearest.weight[k] * directions.col(a);
  }
  if (nearest.slides == 1) {
    all -= mixed.col(0) * mixed.col(0).transpose() / directions.col(0).squaredNorm();
  } else if (nearest.slides == 2) {
    const Eigen::Matrix2d inner = directions.transpose() * directions;
    all -= mixed * inner.inverse() * mixed.transpose();
  }
  return all;
}

double clear_fraction(const LayerPair& pair, const Nodes& from, const Nodes& to, double distance_m,
                      double least_m, double most) {
  Places p = places_of(pair, from), displacement = places_of(pair, to);
  Vector3d mean = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    displacement[k] -= p[k];
    mean += 0.25 * displacement[k];
  }
  double first = 0, second = 0;
  const int firsts = pair.edges ? 2 : 1;
  for (int k = 0; k < 4; ++k) {
    const double size = (displacement[k] - mean).norm();
    (k < firsts ? first : second) = std::max(k < firsts ? first : second, size);
  }
  const double fastest = first + second;
  if (!(fastest > 0)) return 1;
  double fraction = 0;
  double room = distance_m - least_m;
  const double enough = kNearly * room;
  for (int k = 0; k < kAdvances && room > 0; ++k) {
    if (k > 0 && room <= enough) return fraction;
    const double next = fraction + (1 - 0.5 * kNearly) * room / fastest;
    if (next >= 1) return 1;
    fraction = next;
    if (fraction >= most) return fraction;
    Places here;
    for (int c = 0; c < 4; ++c) here[c] = p[c] + fraction * displacement[c];
    room = nearest_of(pair, here).apart.norm() - least_m;
  }
  return fraction;
}

double part_of(const LayerPair& pair, const Nodes& position) {
  if (!pair.edges) return 1;
  const Places p = places_of(pair, position);
  const Vector3d u = p[1] - p[0], v = p[3] - p[2];
  const double sizes = u.squaredNorm() * v.squaredNorm();
  const double crossing = sizes > 0 ? u.cross(v).squaredNorm() / sizes / kSmooth : 0.0;
  return crossing < 1 ? crossing * (2 - crossing) : 1.0;
}

bool are_apart(const LayerPair& pair, const Nodes& position, double reach_m) {
  const int firsts = pair.edges ? 2 : 1;
  for (int axis = 0; axis < 3; ++axis) {
    double low[2], high[2];
    for (int k = 0; k < 4; ++k) {
      const int side = k < firsts ? 0 : 1;
      const double value = position[pair.node[k]][axis];
      const bool first = k == 0 || k == firsts;
      low[side] = first ? value : std::min(low[side], value);
      high[side] = first ? value : std::max(high[side], value);
    }
    if (std::max(low[0] - high[1], low[1] - high[0]) > kBeyond * reach_m) return true;
  }
  return false;
}

LayerLaw layer_law(double distance_m, double thickness_m, double n_per_m) {
  const double d = std::max(distance_m, kNearest * thickness_m);
  const double in = thickness_m - d;
  LayerLaw law{0.5 * in * in, -in, 1};
  const double stiff = kLayersStiffen * thickness_m;
  if (d < stiff) {
    const double left = stiff - d, log = std::log(d / stiff);
    law.energy_j -= left * left * log;
    law.slope_n += 2 * left * log - left * left / d;
    law.stiffness_n_per_m += -2 * log + 4 * left / d + left * left / (d * d);
  }
  law.energy_j *= n_per_m;
  law.slope_n *= n_per_m;
  law.stiffness_n_per_m *= n_per_m;
  return law;
}

}  // namespace drape::simulate

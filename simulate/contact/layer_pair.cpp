// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/layer_pair.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr int kLeaf = 4;

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

constexpr int kNeighbourSteps = 3;
constexpr double kMostStrips = 1e6;

struct Triangle {
  std::array<Vector3d, 3> corner;
  std::array<int, 3> particle{};
  Vector3d centre;
  Eigen::Vector2d in_sheet;  ///< material position of its cell or centre, in steps along warp, weft
};

std::vector<Triangle> triangles_of(const std::vector<std::array<int, 3>>& facets,
                                   const std::vector<Eigen::Vector2d>& material_m, double step_m,
                                   const std::vector<Vector3d>& x) {
  std::vector<Triangle> all;
  for (const auto& f : facets) {
    Triangle t;
    t.particle = f;
    t.centre.setZero();
    t.in_sheet.setZero();
    for (int k = 0; k < 3; ++k) {
      t.corner[k] = x[f[k]];
      t.centre += t.corner[k] / 3;
      if (!material_m.empty()) t.in_sheet += material_m[f[k]] / (3 * step_m);
    }
    all.push_back(t);
  }
  return all;
}

/// Distance of a point from a triangle (Ericson, Real-Time Collision Detection, by Voronoi regions:
/// foot of the perpendicular if inside, else the nearest edge).
double point_triangle(const Vector3d& p, const Triangle& t) {
  const Vector3d u = t.corner[1] - t.corner[0], v = t.corner[2] - t.corner[0];
  const Vector3d normal = u.cross(v);
  const double area2 = normal.squaredNorm();
  double least = 1e300;
  if (area2 > 0) {
    const Vector3d w = p - t.corner[0];
    const double beta = w.cross(v).dot(normal) / area2;
    const double gamma = u.cross(w).dot(normal) / area2;
    if (beta >= 0 && gamma >= 0 && beta + gamma <= 1)
      return std::abs(w.dot(normal)) / std::sqrt(area2);
  }
  for (int k = 0; k < 3; ++k) {
    const Vector3d edge = t.corner[(k + 1) % 3] - t.corner[k];
    const double fraction =
        std::clamp((p - t.corner[k]).dot(edge) / std::max(1e-300, edge.squaredNorm()), 0.0, 1.0);
    least = std::min(least, (t.corner[k] + fraction * edge - p).norm());
  }
  return least;
}

/// Distance of two segments if their nearest points are inside both, else a large value: then a
/// nearest point is an end, which point_triangle() covers.
double edge_edge(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double det = uu * vv - uv * uv;
  if (det <= 1e-12 * uu * vv) return 1e300;
  const double s = (uv * v.dot(w) - vv * u.dot(w)) / det;
  const double t = (uu * v.dot(w) - uv * u.dot(w)) / det;
  if (s < 0 || s > 1 || t < 0 || t > 1) return 1e300;
  return (w + s * u - t * v).norm();
}

/// True if an edge of `one` intersects `t` and they have no particle in common.
bool pierces(const Triangle& one, const Triangle& t) {
  const Vector3d normal = (t.corner[1] - t.corner[0]).cross(t.corner[2] - t.corner[0]);
  const auto passes = [&](int from, int to) {
    for (const int particle : t.particle) {
      if (particle == one.particle[from] || particle == one.particle[to]) return false;
    }
    const Vector3d &a = one.corner[from], &b = one.corner[to];
    const double before = (a - t.corner[0]).dot(normal), after = (b - t.corner[0]).dot(normal);
    if (before * after >= 0) return false;
    const Vector3d p = a + before / (before - after) * (b - a);
    for (int k = 0; k < 3; ++k) {
      const Vector3d edge = t.corner[(k + 1) % 3] - t.corner[k];
      if (edge.cross(p - t.corner[k]).dot(normal) < 0) return false;
    }
    return true;
  };
  return passes(0, 1) || passes(1, 2) || passes(2, 0);
}

void judge_pair(const Triangle& one, const Triangle& two, SelfDistance& found, double& least) {
  if (pierces(one, two) || pierces(two, one)) {
    ++found.crossings;
    least = 0;
  }
  if ((one.in_sheet - two.in_sheet).cwiseAbs().maxCoeff() < kNeighbourSteps) return;
  for (int k = 0; k < 3; ++k) {
    const Vector3d &a = one.corner[k], &b = one.corner[(k + 1) % 3];
    least = std::min({least, point_triangle(a, two), point_triangle(two.corner[k], one)});
    for (int m = 0; m < 3; ++m)
      least = std::min(least, edge_edge(a, b, two.corner[m], two.corner[(m + 1) % 3]));
  }
}

/// Centres of triangles in strips across the sheet's second-longest extent, sorted along the
/// longest one, to find close pairs quickly.
class Strips {
 public:
  /// Supports pairs up to `width` apart.
  Strips(const std::vector<Triangle>& triangles, double width) {
    Eigen::AlignedBox3d extent;
    for (const Triangle& t : triangles) extent.extend(t.centre);
    Vector3d sizes = extent.sizes();
    sizes.maxCoeff(&along_);
    sizes[along_] = -1;
    Eigen::Index across = 0;
    sizes.maxCoeff(&across);
    const bool apart =
        !(sizes[across] < kMostStrips * width);  // one strip if sheet has flown apart
    for (const Triangle& t : triangles) {
      const double strip = apart ? 0 : (t.centre[across] - extent.min()[across]) / width;
      places_.push_back({t.centre, static_cast<int>(places_.size()), static_cast<int>(strip)});
    }
    std::stable_sort(places_.begin(), places_.end(), [&](const Place& a, const Place& b) {
      return a.strip != b.strip ? a.strip < b.strip : a.centre[along_] < b.centre[along_];
    });
  }
  /// Calls `use` with two triangles whose centres are within reach(), evaluated at that time.
  template <class Reach, class Use>
  void for_each_pair(const Reach& reach, const Use& use) const {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const Place& one = places_[i];
      const auto meet = [&](std::size_t from, int strip) {
        for (std::size_t j = from; j < places_.size() && places_[j].strip == strip; ++j) {
          const Place& two = places_[j];
          const double near = reach();
          if (two.centre[along_] - one.centre[along_] > near) break;
          if ((one.centre - two.centre).squaredNorm() <= near * near)
            use(one.triangle, two.triangle);
        }
      };
      meet(i + 1, one.strip);
      const auto before = [&](const Place& p) {
        return p.strip <= one.strip ||
               (p.strip == one.strip + 1 && p.centre[along_] < one.centre[along_] - reach());
      };
      const auto next = std::partition_point(places_.begin(), places_.end(), before);
      meet(static_cast<std::size_t>(next - places_.begin()), one.strip + 1);
    }
  }

 private:
  struct Place {
    Vector3d centre;
    int triangle = 0;
    int strip = 0;
  };
  Eigen::Index along_ = 0;
  std::vector<Place> places_;
};

double largest_radius(const std::vector<Triangle>& triangles) {
  double radius = 0;
  for (const Triangle& t : triangles) {
    for (const Vector3d& corner : t.corner) radius = std::max(radius, (corner - t.centre).norm());
  }
  return radius;
}

bool any_pierces(const std::vector<Triangle>& triangles) {
  const double reach = 2 * largest_radius(triangles);
  const Strips strips(triangles, reach);
  bool passes = false;
  strips.for_each_pair([&] { return passes ? 0 : reach; },
                       [&](int i, int j) {
                         const Triangle &one = triangles[i], &two = triangles[j];
                         passes = passes || pierces(one, two) || pierces(two, one);
                       });
  return passes;
}

/// Searches for distances up to `cap`.
SelfDistance distance_of(const std::vector<Triangle>& triangles, double cap) {
  const double radius = largest_radius(triangles);
  const Strips strips(triangles, cap + 2 * radius);
  SelfDistance found;
  double least = cap;
  strips.for_each_pair([&] { return least + 2 * radius; },
                       [&](int i, int j) { judge_pair(triangles[i], triangles[j], found, least); });
  if (least < cap) found.least_m = least;
  return found;
}

}  // namespace

BoxTree::BoxTree(const std::vector<Vector3d>& centres) : order_(centres.size()) {
  if (centres.empty()) return;
  std::iota(order_.begin(), order_.end(), 0);
  Node root;
  root.count = static_cast<int>(centres.size());
  nodes_.push_back(root);
  for (int node = 0; node < static_cast<int>(nodes_.size()); ++node) build(node, centres);
}

void BoxTree::build(int node, const std::vector<Vector3d>& centres) {
  const int first = nodes_[node].first, count = nodes_[node].count;
  if (count <= kLeaf) return;
  Eigen::AlignedBox3d extent;
  for (int k = first; k < first + count; ++k) extent.extend(centres[order_[k]]);
  Eigen::Index axis = 0;
  extent.sizes().maxCoeff(&axis);
  const int half = count / 2;
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](int s, int t) {
    const double a = centres[s][axis], b = centres[t][axis];
    return a < b || (a == b && s < t);
  });
  nodes_[node].left = static_cast<int>(nodes_.size());
  Node child;
  child.first = first;
  child.count = half;
  nodes_.push_back(child);
  child.first = first + half;
  child.count = count - half;
  nodes_.push_back(child);
}

void BoxTree::refit(const std::vector<Eigen::AlignedBox3d>& boxes) {
  boxes_ = boxes;
  for (auto node = nodes_.rbegin(); node != nodes_.rend(); ++node) {
    node->box.setEmpty();
    if (node->left >= 0) {
      node->box = nodes_[node->left].box.merged(nodes_[node->left + 1].box);
      continue;
    }
    for (int k = node->first; k < node->first + node->count; ++k) {
      node->box.extend(boxes_[order_[k]]);
    }
  }
}

bool share_a_node(const LayerPair& pair) {
  const int firsts = pair.edges ? 2 : 1;
  for (int k = 0; k < firsts; ++k)
    for (int l = firsts; l < 4; ++l)
      if (pair.node[k] == pair.node[l]) return true;
  return false;
}

std::vector<LayerFacet> layer_facets(const std::vector<std::array<int, 3>>& facets) {
  std::vector<LayerFacet> found;
  std::set<int> owned;
  std::set<std::array<int, 2>> edges;
  for (const std::array<int, 3>& node : facets) {
    LayerFacet& facet = found.emplace_back(LayerFacet{node, {}, {}});
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(node[k], node[(k + 1) % 3]);
      if (owned.insert(node[k]).second) facet.own.push_back(node[k]);
      if (edges.insert({low, high}).second) facet.edges.push_back({low, high});
    }
  }
  return found;
}

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

bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                           const std::vector<Vector3d>& places) {
  return any_pierces(triangles_of(facets, {}, 1, places));
}

SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                           const std::vector<Eigen::Vector2d>& material_m, double step_m,
                           const std::vector<Vector3d>& places) {
  return distance_of(triangles_of(facets, material_m, step_m, places), step_m);
}

}  // namespace drape::simulate

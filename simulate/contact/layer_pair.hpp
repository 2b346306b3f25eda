// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace drape::simulate {

/// Tree of axis-aligned boxes over items 0 .. n - 1, for overlap queries. Its structure is derived
/// from the items' centres once; the boxes may move later.
class BoxTree {
 public:
  BoxTree() = default;
  explicit BoxTree(const std::vector<Eigen::Vector3d>& centres);

  /// Updates the items' boxes.
  void refit(const std::vector<Eigen::AlignedBox3d>& boxes);

  /// Calls visit(one, other) once for every pair of items with overlapping boxes, the lower number
  /// first, in an order that depends on the centres only.
  template <class Visit>
  void query_pairs(Visit visit) const {
    if (!nodes_.empty()) search_pairs(0, 0, visit);
  }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< range of order_; a leaf has no children
    int left = -1;             ///< index of the left child; the right one is left + 1
  };

  template <class Visit>
  void search_pairs(int one, int two, Visit& visit) const {
    const Node &a = nodes_[one], &b = nodes_[two];
    if (one != two && !a.box.intersects(b.box)) return;
    if (a.left < 0 && b.left < 0) {
      for (int k = a.first; k < a.first + a.count; ++k) {
        for (int l = one == two ? k + 1 : b.first; l < b.first + b.count; ++l) {
          const int s = order_[k], t = order_[l];
          if (boxes_[s].intersects(boxes_[t])) visit(std::min(s, t), std::max(s, t));
        }
      }
      return;
    }
    if (one == two) {
      search_pairs(a.left, a.left, visit);
      search_pairs(a.left + 1, a.left + 1, visit);
      search_pairs(a.left, a.left + 1, visit);
    } else if (a.left >= 0 && (b.left < 0 || a.count >= b.count)) {
      search_pairs(a.left, two, visit);
      search_pairs(a.left + 1, two, visit);
    } else {
      search_pairs(one, b.left, visit);
      search_pairs(one, b.left + 1, visit);
    }
  }
  void build(int node, const std::vector<Eigen::Vector3d>& centres);

  std::vector<Node> nodes_;  ///< children come after their parent
  std::vector<int> order_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

/// Positions of the nodes of a surface (m).
using Nodes = std::vector<Eigen::Vector3d>;

/// Two parts of a surface in potential contact: a node and a triangle, or two edges.
struct LayerPair {
  bool edges = false;
  std::array<int, 4> node{};  ///< one node, then three of the triangle; or two per edge
  auto operator<=>(const LayerPair&) const =
      default;  // NOLINT(modernize-use-nullptr): by the compiler
};

/// True if a node belongs to both parts.
[[nodiscard]] bool share_a_node(const LayerPair& pair);

/// A facet of a surface, with the nodes and edges that no earlier one has.
struct LayerFacet {
  std::array<int, 3> node{};
  std::vector<int> own;
  std::vector<std::array<int, 2>> edges;
};
[[nodiscard]] std::vector<LayerFacet> layer_facets(const std::vector<std::array<int, 3>>& facets);
/// Calls visit(pair) for each pair of a facet's own nodes and edges with the other facet.
template <class Visit>
void visit_pairs(const LayerFacet& a, const LayerFacet& b, Visit visit) {
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)})
    for (const int i : from->own)
      visit(LayerPair{false, {i, to->node[0], to->node[1], to->node[2]}});
  for (const auto& one : a.edges)
    for (const auto& two : b.edges) visit(LayerPair{true, {one[0], one[1], two[0], two[1]}});
}

/// Nearest points of a pair, over the whole triangle or edges, so that the distance is a continuous
/// function of the nodes, and smooth except for parallel edges.
struct NearestPoints {
  /// Weights of the nodes: positive for the first part, negative for the second; magnitudes add up
  /// to one for each.
  std::array<double, 4> weight{};
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  ///< vector from the second point to the first
  /// Changes of the weights along the directions in which the points can slide.
  std::array<std::array<double, 4>, 2> slide{};
  int slides = 0;
};
[[nodiscard]] NearestPoints nearest_points(const LayerPair& pair, const Nodes& position);

/// Second derivative of half the squared distance by the nodes (dimensionless), including the
/// sliding of the nearest points.
[[nodiscard]] Eigen::Matrix<double, 12, 12> distance_curvature(const LayerPair& pair,
                                                               const NearestPoints& nearest,
                                                               const Nodes& position);

/// Fraction of the straight path from `from` to `to` that keeps the pair at least `least_m`
/// apart, 1 for all of it, by additive conservative advancement (Li, Kaufman and Jiang 2021).
/// Never too large. The pair is `distance_m` apart at `from`. The search stops at a fraction of
/// `most`.
[[nodiscard]] double clear_fraction(const LayerPair& pair, const Nodes& from, const Nodes& to,
                                    double distance_m, double least_m, double most = 1);

/// Weight of a pair: 1, decreasing to 0 as two edges become parallel.
[[nodiscard]] double part_of(const LayerPair& pair, const Nodes& position);

/// True if bounding boxes of the two parts are more than `reach_m` apart; cheaper than their
/// distance.
[[nodiscard]] bool are_apart(const LayerPair& pair, const Nodes& position, double reach_m);

/// Fraction of the thickness below which the barrier sets in.
inline constexpr double kLayersStiffen = 0.5;
/// Least fraction of a pair's distance that remains after a step.
inline constexpr double kLayersKeep = 0.2;

/// Energy of a pair closer than the thickness, with its derivatives by the distance (N and N/m): a
/// spring of `n_per_m`, plus below half the thickness a barrier that diverges at zero (Li et al.
/// 2020), so that no force can close the gap.
struct LayerLaw {
  double energy_j = 0, slope_n = 0, stiffness_n_per_m = 0;
};
[[nodiscard]] LayerLaw layer_law(double distance_m, double thickness_m, double n_per_m);

/// Smallest distance of a sheet of triangles from itself. Distances between triangles less than
/// three steps apart along the sheet do not count, but their intersections do.
struct SelfDistance {
  std::optional<double> least_m;  ///< absent if nothing is closer than one step
  int crossings = 0;              ///< pairs of triangles that intersect
};
/// `material_m`: material coordinates (warp, weft) of corners; `step_m`: a step along the sheet.
[[nodiscard]] SelfDistance self_distance(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector2d>& material_m,
                                         double step_m, const std::vector<Eigen::Vector3d>& places);
/// True if there are intersections; cheaper than counting them.
[[nodiscard]] bool passes_through_itself(const std::vector<std::array<int, 3>>& facets,
                                         const std::vector<Eigen::Vector3d>& places);

}  // namespace drape::simulate

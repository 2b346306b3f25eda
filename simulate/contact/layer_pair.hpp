// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace drape::simulate {

/// Positions of the nodes of a surface (m).
using Nodes = std::vector<Eigen::Vector3d>;

/// Two parts of a surface in potential contact: a node and a triangle, or two edges.
struct LayerPair {
  bool edges = false;
  std::array<int, 4> node{};  ///< one node, then three of the triangle; or two per edge
  auto operator<=>(const LayerPair&) const =
      default;  // NOLINT(modernize-use-nullptr): by the compiler
};

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

/// Weight of a pair: 1, less for nearly parallel edges, 0 for parallel ones.
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

}  // namespace drape::simulate

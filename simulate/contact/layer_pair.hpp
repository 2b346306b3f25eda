// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace drape::simulate {

/// Places of the nodes of a surface (m).
using Nodes = std::vector<Eigen::Vector3d>;

/// Two pieces of a surface that may press on each other: a node and a triangle, or two edges.
struct LayerPair {
  bool edges = false;
  std::array<int, 4> node{};  ///< one, then three; or two, then two
  auto operator<=>(const LayerPair&) const =
      default;  // NOLINT(modernize-use-nullptr): by the compiler
};

/// The nearest points of a pair, of the whole triangle or edges: so the distance is a continuous
/// function of the nodes, and a smooth one but where two edges are parallel.
struct NearestPoints {
  /// Weights of the nodes: positive on the first piece, negative on the second, each adding up
  /// to one.
  std::array<double, 4> weight{};
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  ///< from the second point to the first
  /// Changes of the weights along the directions in which the points are free.
  std::array<std::array<double, 4>, 2> slide{};
  int slides = 0;
};
[[nodiscard]] NearestPoints nearest_points(const LayerPair& pair, const Nodes& position);

/// Second derivative of half the squared distance (m^0), node by node: the points slide
/// with it.
[[nodiscard]] Eigen::Matrix<double, 12, 12> distance_curvature(const LayerPair& pair,
                                                               const NearestPoints& nearest,
                                                               const Nodes& position);

/// The part of the straight path from `from` to `to` that brings the pair no nearer than `least_m`,
/// 1 for all of it, by steps that relative displacements cannot use up (additive conservative
/// advancement: Li, Kaufman and Jiang 2021). Never too large. The pair is `distance_m` apart at
/// `from`. A part of `most` or more is not looked for any further.
[[nodiscard]] double clear_fraction(const LayerPair& pair, const Nodes& from, const Nodes& to,
                                    double distance_m, double least_m, double most = 1);

/// Factor of a pair: 1, of edges that are nearly parallel less, of parallel ones nothing.
[[nodiscard]] double part_of(const LayerPair& pair, const Nodes& position);

/// True if boxes about the two pieces are more than `reach_m` apart, which costs less than their
/// distance.
[[nodiscard]] bool are_apart(const LayerPair& pair, const Nodes& position, double reach_m);

/// Fraction of the thickness below which layers stiffen.
inline constexpr double kLayersStiffen = 0.5;
/// Fraction of a pair's distance that a step leaves.
inline constexpr double kLayersKeep = 0.2;

/// Energy of a pair that is nearer than the thickness, and its derivatives by the distance (N and
/// N/m): a spring of `n_per_m`, and from half a thickness on ever stiffer (Li et al. 2020), so that
/// no force closes the last of it.
struct LayerLaw {
  double energy_j = 0, slope_n = 0, stiffness_n_per_m = 0;
};
[[nodiscard]] LayerLaw layer_law(double distance_m, double thickness_m, double n_per_m);

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace drape::simulate {

/// Nearest points of two features, each given by points in one list of four.
struct Nearest {
  /// Weights of the four points: positive on the first feature, negative on the second, each side
  /// adding up to one.
  std::array<double, 4> weight{};
  Eigen::Vector3d apart = Eigen::Vector3d::Zero();  ///< from the second feature to the first
};

/// Point p and the triangle a, b, c: the nearest point of the whole triangle.
[[nodiscard]] Nearest point_to_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                        const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Point p and the plane of a triangle, where its foot lies inside, or outside by at most `slack`
/// of the triangle's heights; absent otherwise.
[[nodiscard]] std::optional<Nearest> point_over_triangle(const Eigen::Vector3d& p,
                                                         const Eigen::Vector3d& a,
                                                         const Eigen::Vector3d& b,
                                                         const Eigen::Vector3d& c, double slack);

/// Edges a, b and c, d where the nearest points of their lines lie inside both, or beyond an end by
/// at most `slack` of the edge's length; absent otherwise: the nearest pair is then one of an end.
[[nodiscard]] std::optional<Nearest> edge_to_edge(const Eigen::Vector3d& a,
                                                  const Eigen::Vector3d& b,
                                                  const Eigen::Vector3d& c,
                                                  const Eigen::Vector3d& d, double slack = 0);

[[nodiscard]] double point_to_edge_m(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                     const Eigen::Vector3d& b);

}  // namespace drape::simulate

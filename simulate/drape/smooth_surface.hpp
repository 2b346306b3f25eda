// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// Smooth map from material points to positions through scattered data: at each point the
/// least-squares polynomial of the nearest 24, weighted by exp(-2.5 (d / reach)^2) (moving least
/// squares: Lancaster and Salkauskas 1981). It is cubic if those points determine a cubic, else
/// quadratic or linear, and reproduces such maps exactly. It extrapolates beyond the points. The
/// cost of an evaluation does not depend on their number.
class SmoothSurface {
 public:
  /// `places` (m) correspond to material points (warp, weft; m), at least three and not collinear.
  /// Throws Error(bad_input) otherwise.
  SmoothSurface(std::vector<Eigen::Vector2d> material_m, std::vector<Eigen::Vector3d> places);

  [[nodiscard]] MeshCloth::Jet at(const Eigen::Vector2d& material_m) const;

 private:
  struct Near {
    double distance2 = 0;
    int point = 0;
    auto operator<=>(const Near&) const = default;
  };
  [[nodiscard]] std::vector<Near> nearest(const Eigen::Vector2d& p) const;
  [[nodiscard]] Eigen::Array2i cell_of(const Eigen::Vector2d& p) const;

  std::vector<Eigen::Vector2d> material_;
  std::vector<Eigen::Vector3d> places_;
  Eigen::Vector2d low_;
  double cell_m_ = 0;
  Eigen::Array2i cells_;
  std::vector<std::vector<int>> points_of_;  ///< indices by cell
};

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// Square cells over a rectangle.
struct Cells {
  Eigen::Vector2d low;
  double size_m = 0;
  Eigen::Array2i count;

  Cells() = default;
  Cells(const Eigen::Vector2d& from, const Eigen::Vector2d& extent, double cell_m)
      : low(from), size_m(cell_m), count((extent / cell_m).array().floor().cast<int>() + 1) {}
  /// Column and row of the cell that holds a point; outside, those of the nearest cell.
  [[nodiscard]] Eigen::Array2i of(const Eigen::Vector2d& p) const {
    return ((p - low) / size_m).array().floor().max(0).min(count.cast<double>() - 1).cast<int>();
  }
  [[nodiscard]] int index(int i, int j) const { return i * count.y() + j; }
};

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

  std::vector<Eigen::Vector2d> material_;
  std::vector<Eigen::Vector3d> places_;
  Cells cells_;
  std::vector<std::vector<int>> points_of_;  ///< indices by cell
};

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>

#include "core/sheet.hpp"

namespace drape::triangulate {

/// Place of a material point as the measured marks around it show it.
struct ShownPlace {
  Eigen::Vector3d point_in_world;
  Eigen::Matrix3d covariance_m2;  ///< of the marks, and of the surface between and beyond them
};

/// Surface through the measured marks over their material coordinates: kriging with the generalised
/// covariance h^3 and a linear trend (Matheron 1973), whose variance grows with the distance from
/// the marks. Its coefficient, a matrix over x, y and z, is the mean square by which the marks
/// nearest to the point miss the surface through all others.
class MeasuredCloth {
 public:
  explicit MeasuredCloth(const Sheet& sheet) : sheet_(sheet) {}
  /// Nothing with fewer than nine marks, or marks in one line.
  [[nodiscard]] std::optional<ShownPlace> at(const Eigen::Vector2d& material_m) const;
  [[nodiscard]] const Sheet& sheet() const { return sheet_; }

 private:
  [[nodiscard]] std::optional<ShownPlace> computed(const Eigen::Vector2d& material_m) const;

  const Sheet& sheet_;
  mutable std::map<std::pair<double, double>, std::optional<ShownPlace>> known_;
};

}  // namespace drape::triangulate

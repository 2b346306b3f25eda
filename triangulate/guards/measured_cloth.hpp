// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>

#include "core/sheet.hpp"

namespace drape::triangulate {

/// Position of a material point, interpolated from the measured marks around it.
struct ShownPlace {
  Eigen::Vector3d point_in_world;
  Eigen::Matrix3d covariance_m2;  ///< marks, and the surface between and beyond them
};

/// Surface through the measured marks over material coordinates: kriging with the generalised
/// covariance h^3 and a linear trend (Matheron 1973), whose variance grows with the distance from
/// the marks. Its coefficient, a matrix over x, y and z, is the mean square leave-one-out error of
/// the marks nearest to the point.
class MeasuredCloth {
 public:
  explicit MeasuredCloth(const Sheet& sheet) : sheet_(sheet) {}
  /// nullopt for fewer than nine marks, or collinear ones.
  [[nodiscard]] std::optional<ShownPlace> at(const Eigen::Vector2d& material_m) const;
  [[nodiscard]] const Sheet& sheet() const { return sheet_; }

 private:
  [[nodiscard]] std::optional<ShownPlace> computed(const Eigen::Vector2d& material_m) const;

  const Sheet& sheet_;
  mutable std::map<std::pair<double, double>, std::optional<ShownPlace>> known_;
};

}  // namespace drape::triangulate

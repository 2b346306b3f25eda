// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/detections.hpp"
#include "core/scene.hpp"
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

/// Explains why pins and clamps cannot hold the cloth at the stated positions. Compares each held
/// point with the surface through the measured marks at its material point: chi square over
/// place_uncertainty_mm, the marks' covariance and that of the surface, three degrees of freedom, a
/// risk of 0.005 over all points. On failure, tries other corners, hems and diagonals, exchanged
/// positions, signs, axes and units, then a common shift, then a single point, and suggests the
/// only one that passes. A pin without at_mm must lie on a measured mark.
[[nodiscard]] std::vector<std::string> contradictions_of_held(const Sheet& sheet,
                                                              const Scene& scene,
                                                              const MarkLattice& lattice);

/// Scene suggested by contradictions_of_held(), with the fitted values as printed in its message.
/// nullopt if the stated one passes, none does, or two pass equally well.
struct SuggestedScene {
  Scene scene;
  std::string what;       ///< "the other hem", "all 6.0 mm lower"
  double expanded_m = 0;  ///< for each fitted position, k = 2; 0 if none was fitted
};

[[nodiscard]] std::optional<SuggestedScene> suggested_holding(const Sheet& sheet,
                                                              const Scene& scene,
                                                              const MarkLattice& lattice);

/// Describes, for each held point, the largest position error that would go unnoticed.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> unseen_of_held(
    const Sheet& sheet, const Scene& scene, const MarkLattice& lattice);

/// Explains why gravity cannot have the stated direction. The centre of mass of cloth that hangs
/// freely from one or two points lies straight below the point, or below the line through both.
/// Limit: 99.5 % quantile of level_uncertainty_deg combined with the uncertainties of the measured
/// centre of mass and held points over its depth below them.
[[nodiscard]] std::vector<std::string> contradictions_of_gravity(const MeasuredCloth& cloth,
                                                                 const Scene& scene,
                                                                 const MarkLattice& lattice);

}  // namespace drape::triangulate

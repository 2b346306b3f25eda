// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "triangulate/guards/measured_cloth.hpp"

namespace drape::triangulate {

/// A point of the cloth that the scene says is held at a place: a pin with at_mm, an end of a
/// clamp.
struct HeldPoint {
  std::string name;  ///< "pin 1, at_mm"
  Eigen::Vector2d material_m;
  Eigen::Vector3d point_in_world;
  double place_m = 0;  ///< standard uncertainty along each axis
};
[[nodiscard]] std::vector<HeldPoint> held_points(const Scene& scene, const MarkLattice& lattice);

/// Why pins and clamps cannot hold what the scene says where it says so. Each held point is
/// compared with the surface through the measured marks at its material point: chi square over
/// place_uncertainty_mm, the marks' covariance and the surface's own, with three degrees of freedom
/// and a risk of 0.005 over all points. Other corners, hems and diagonals, exchanged places, signs,
/// axes and units are tried next, then a common shift, then one point alone, and what alone passes
/// the same test is suggested. A pin without at_mm must lie on a measured mark.
[[nodiscard]] std::vector<std::string> contradictions_of_held(const Sheet& sheet,
                                                              const Scene& scene,
                                                              const MarkLattice& lattice);

/// The scene that contradictions_of_held() suggests, with the fitted values as its message prints
/// them. Nothing where the stated one passes, where none does, or where two pass alike.
struct SuggestedScene {
  Scene scene;
  std::string what;       ///< "the other hem", "all 6.0 mm lower"
  double expanded_m = 0;  ///< k = 2, of each fitted place; 0: no place was fitted
};
[[nodiscard]] std::optional<SuggestedScene> suggested_holding(const Sheet& sheet,
                                                              const Scene& scene,
                                                              const MarkLattice& lattice);

/// The error of a held point's place that would not be seen, in words, for each of them.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> unseen_of_held(
    const Sheet& sheet, const Scene& scene, const MarkLattice& lattice);

/// Why gravity cannot point where the scene says: cloth that hangs from one or two points and
/// touches nothing has its centre of mass straight below the point, or below the line through both.
/// Limit: the upper half per cent of level_uncertainty_deg and of the uncertainty of the centre of
/// mass and the held points as measured, over its depth below them.
[[nodiscard]] std::vector<std::string> contradictions_of_gravity(const MeasuredCloth& cloth,
                                                                 const Scene& scene,
                                                                 const MarkLattice& lattice);

}  // namespace drape::triangulate

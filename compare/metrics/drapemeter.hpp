// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// One harmonic of the hem's radius: amplitude cos(order angle - phase).
struct Harmonic {
  int order = 0;
  double amplitude_m = 0;
  double phase_rad = 0;  ///< angle of the first crest times the order; 0 when the amplitude is 0
};

/// Numbers of a drapemeter: the shadow of the cloth on the table, light from straight above
/// (Cusick 1968). Angles from +x about the vertical through `centre`.
struct Drapemeter {
  Eigen::Vector2d centre_in_world;  ///< metres
  double covered_area_m2 = 0;       ///< area of the shadow
  double flat_area_m2 = 0;          ///< area of the cloth before draping
  /// (shadow - support) / (flat - support); absent without a flat support under the cloth.
  std::optional<double> drape_coefficient;
  double mean_radius_m = 0;
  int folds = 0;                   ///< crests of the hem
  double fold_depth_m = 0;         ///< mean crest minus mean valley; 0 without a fold
  std::vector<Harmonic> spectrum;  ///< orders 1 to 24
};

/// The outermost marks of a lattice, in turn.
[[nodiscard]] std::vector<MarkId> border_of(int rows, int cols);

/// Why nothing can be said of a sheet's hem: outermost marks that are missing; else empty.
[[nodiscard]] std::string why_no_hem(const Sheet& sheet);

/// Crests and valleys of a closed outline that differ by at least `least_m`, in turn, all around:
/// walking on, an extreme counts once the radius has come back from it by that much. Indices into
/// the outline; as many crests as valleys.
struct Extremes {
  std::vector<std::size_t> crests, valleys;
};
[[nodiscard]] Extremes extremes_of(const std::vector<double>& radius_m, double least_m);

/// Raises the outline, seen from the origin, to where the segment a-b meets its rays (equal steps
/// of angle from +x).
void raise_outline(std::vector<std::optional<double>>& outline, const Eigen::Vector2d& a_m,
                   const Eigen::Vector2d& b_m);

/// The radii of an outline that has one at every ray.
[[nodiscard]] std::optional<std::vector<double>> closed(
    const std::vector<std::optional<double>>& outline);

/// Coefficients c_k of radius(angle) = sum over k of Re(c_k exp(i k angle)), k = 0 .. most.
[[nodiscard]] std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius,
                                                            int most);

/// Outline of the shadow: the largest distance from the centre at which a ray meets an edge of the
/// sheet's cells; exact where the rays meet vertices. Nothing at rays without cloth.
[[nodiscard]] std::vector<std::optional<double>> shadow_outline(const Sheet& sheet,
                                                                const Eigen::Vector2d& centre_m,
                                                                int rays);

/// Area, folds and spectrum of a closed outline with equal steps of angle.
[[nodiscard]] Drapemeter drapemeter_of(const std::vector<double>& radius_m, double flat_area_m2,
                                       std::optional<double> support_area_m2);

/// The whole: centre above the obstacle's centre. `reason` says why there is none: a sheet with
/// gaps at the hem, no obstacle, or cloth that does not go around the centre.
struct DrapemeterResult {
  std::optional<Drapemeter> value;
  std::string reason;
};
[[nodiscard]] DrapemeterResult drapemeter(const Sheet& sheet, const Scene& scene);

/// Middle of a sphere, box or cylinder seen from above; a plane or a mesh has none.
[[nodiscard]] std::optional<Eigen::Vector2d> centre_of(const Obstacle& obstacle);

/// Area of an obstacle's flat top: a box that stands upright; a sphere has none.
[[nodiscard]] std::optional<double> support_area_m2(const Obstacle& obstacle);

}  // namespace drape::compare

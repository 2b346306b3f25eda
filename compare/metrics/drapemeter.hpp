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
  double phase_rad = 0;  ///< order times the angle of the first crest; 0 if the amplitude is 0
};

/// Drapemeter values of a sheet, from its shadow on the table under light from straight above
/// (Cusick 1968). Angles are from +x about the vertical through `centre`.
struct Drapemeter {
  Eigen::Vector2d centre_in_world;  ///< metres
  double covered_area_m2 = 0;       ///< area of the shadow
  double flat_area_m2 = 0;          ///< area of the cloth before draping
  /// (shadow - support) / (flat - support); absent without a flat support beneath the cloth.
  std::optional<double> drape_coefficient;
  double mean_radius_m = 0;
  int folds = 0;                   ///< number of crests of the hem
  double fold_depth_m = 0;         ///< mean crest minus mean valley; 0 without folds
  std::vector<Harmonic> spectrum;  ///< orders 1 to 24
};

/// The outermost marks of a lattice in cyclic order.
[[nodiscard]] std::vector<MarkId> border_of(int rows, int cols);

/// Names missing outermost marks, which make a sheet's hem unusable; empty if there are none.
[[nodiscard]] std::string why_no_hem(const Sheet& sheet);

/// Alternating crests and valleys around a closed outline that differ by at least `least_m`: an
/// extreme counts once the radius has changed from it by that much. Indices into the outline; equal
/// numbers of crests and valleys.
struct Extremes {
  std::vector<std::size_t> crests, valleys;
};
[[nodiscard]] Extremes extremes_of(const std::vector<double>& radius_m, double least_m);

/// Extends the outline, seen from the origin, to the intersections of the segment a-b with its rays
/// (equal steps of angle from +x).
void raise_outline(std::vector<std::optional<double>>& outline, const Eigen::Vector2d& a_m,
                   const Eigen::Vector2d& b_m);

/// The radii of an outline, or nullopt if one is missing.
[[nodiscard]] std::optional<std::vector<double>> closed(
    const std::vector<std::optional<double>>& outline);

/// Fourier coefficients c_k, k = 0 .. most: radius(angle) = sum over k of Re(c_k exp(i k angle)).
[[nodiscard]] std::vector<std::complex<double>> spectrum_of(const std::vector<double>& radius,
                                                            int most);

/// Outline of the shadow: largest distance from the centre at which a ray meets an edge of the
/// sheet's cells; exact where rays meet vertices. nullopt at rays without cloth.
[[nodiscard]] std::vector<std::optional<double>> shadow_outline(const Sheet& sheet,
                                                                const Eigen::Vector2d& centre_m,
                                                                int rays);

/// Area, folds and spectrum of a closed outline with equal steps of angle.
[[nodiscard]] Drapemeter drapemeter_of(const std::vector<double>& radius_m, double flat_area_m2,
                                       std::optional<double> support_area_m2);

/// Complete result, with the centre above that of the obstacle. `reason` explains why there is
/// none: gaps at the hem, no obstacle, or cloth that does not surround the centre.
struct DrapemeterResult {
  std::optional<Drapemeter> value;
  std::string reason;
};
[[nodiscard]] DrapemeterResult drapemeter(const Sheet& sheet, const Scene& scene);

/// Centre of a sphere, box or cylinder seen from above; nullopt for a plane or mesh.
[[nodiscard]] std::optional<Eigen::Vector2d> centre_of(const Obstacle& obstacle);

/// Area of an obstacle's flat top, if it is an upright box; nullopt for a sphere.
[[nodiscard]] std::optional<double> support_area_m2(const Obstacle& obstacle);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/geometry/outline.hpp"
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

/// Extends the outline, seen from the origin, to the intersections of the segment a-b with its rays
/// (equal steps of angle from +x).
void raise_outline(std::vector<std::optional<double>>& outline, const Eigen::Vector2d& a_m,
                   const Eigen::Vector2d& b_m);

/// The radii of an outline, or nullopt if one is missing.
[[nodiscard]] std::optional<std::vector<double>> closed(
    const std::vector<std::optional<double>>& outline);

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

[[nodiscard]] constexpr double circle_m2(double diameter_m) {
  return std::numbers::pi / 4 * diameter_m * diameter_m;
}

/// Disc and round specimen of a drapemeter test.
struct DrapemeterGeometry {
  std::string name;
  double disc_m = 0, specimen_m = 0;  ///< diameters

  /// Throws Error(usage) unless 0 < disc < specimen.
  void check() const;
};

/// Standard tests: ISO 9073-9 and BS 5058 (disc 180 mm), JIS L 1096 (disc 127 mm).
enum class StandardTest { iso_240, iso_300, iso_360, jis_254 };
[[nodiscard]] DrapemeterGeometry geometry_of(StandardTest test);

/// Hem of a draped specimen seen from above, x right, y up or as in the world.
struct Hem {
  Eigen::Vector2d centre_m;            ///< centroid of the covered area
  double area_m2 = 0;                  ///< covered area
  std::vector<double> radius_m;        ///< about the centre, at equal steps of angle from +x to +y;
                                       ///< outermost where a ray crosses the hem more than once
  std::optional<double> flat_area_m2;  ///< flat specimen, if known better than from its size
};

/// Moments of the area inside a closed outline without crossings, exact for a polygon.
struct AreaMoments {
  double area = 0;  ///< positive if it runs counter-clockwise
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  ///< covariance of the points inside
};
[[nodiscard]] AreaMoments moments_of(const std::vector<Eigen::Vector2d>& outline);

/// Hem of a closed outline without crossings, in either orientation. Throws Error(bad_input),
/// without a location, if the outline does not surround its centre.
[[nodiscard]] Hem hem_of_outline(const std::vector<Eigen::Vector2d>& outline_m);

/// Hem from radii at equal steps of angle, by trigonometric interpolation (orders below half their
/// number); area = pi times the mean square radius, exact for a hem of those orders.
[[nodiscard]] Hem hem_of_radii(const std::vector<double>& radius_m);

/// Number of Fourier orders of a hem that are listed and compared, besides order 0.
inline constexpr int kHemOrders = 16;

/// One fold of the hem.
struct HemNode {
  double angle_rad = 0;     ///< direction of its crest
  double radius_m = 0;      ///< radius of its crest
  double amplitude_m = 0;   ///< half of the crest minus the mean of its adjacent valleys
  double wavelength_m = 0;  ///< arc of the mean circle up to the next crest
};
[[nodiscard]] std::vector<HemNode> nodes_of(const Hem& hem);

/// A drapemeter value in the unit that its name ends with.
struct HemNumber {
  std::string name;
  double value = 0;
  std::optional<double> u;  ///< expanded uncertainty, k = 2; absent if unknown
};

/// drape_coefficient_percent = 100 (A - disc) / (specimen - disc) (Cusick 1968);
/// drape_distance_ratio_percent = 100 (R - r_mean) / (R - r_disc) and
/// fold_depth_index_percent = 100 (r_max - r_min) / (R - r_disc) (Jeong 1998), R that of a round
/// specimen of the same flat area; nodes; mean
/// node_amplitude_mm and node_wavelength_mm; area_mm2, mean, least and largest radius in mm; the
/// amplitudes of the Fourier orders of the radius: order_00_mm (its mean) to order_16_mm.
[[nodiscard]] std::vector<HemNumber> numbers_of(const Hem& hem, const DrapemeterGeometry& geometry);

/// Known errors of a hem.
struct HemErrors {
  /// Hems at grey levels a quarter and three quarters across the edge: the edge lies between them,
  /// with rectangular distribution.
  std::optional<std::pair<Hem, Hem>> edges;
  std::optional<double> scale_u;  ///< relative standard uncertainty of lengths
  /// Hems for the largest possible tilt of the camera to either side, with rectangular
  /// distribution.
  std::optional<std::pair<Hem, Hem>> tilts = {};
};

/// The same values with U: each source is varied, and the changes of the values are added in
/// quadrature (GUM 5.1, numerically), k = 2.
[[nodiscard]] std::vector<HemNumber> numbers_with_u(const Hem& hem, const HemErrors& errors,
                                                    const DrapemeterGeometry& geometry);

[[nodiscard]] double number_named(const std::vector<HemNumber>& numbers, const std::string& name);

/// Amplitudes of the radius' Fourier orders 0 (its mean) to kHemOrders, in metres; invariant to
/// rotation and reflection of the hem.
[[nodiscard]] Eigen::VectorXd order_amplitudes_m(const Hem& hem);

/// Number of radii of a hem that are stored and compared, one every 5 degrees.
inline constexpr int kHemRays = 72;
[[nodiscard]] std::vector<double> thinned(const std::vector<double>& radius_m);

/// RMS difference of two hems' radii after the best rotation, also with reflection; 72 rays.
[[nodiscard]] double hem_distance_m(const Hem& a, const Hem& b);
inline constexpr double kCopies_m = 1e-6;  ///< hems at a smaller distance are copies

}  // namespace drape::compare

template <>
inline constexpr std::string_view drape::names_of<drape::compare::StandardTest>[] = {
    "iso-240", "iso-300", "iso-360", "jis-254"};

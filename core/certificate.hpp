// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// Largest strains to which the Kawabata curves are fitted: extension along warp and weft, shear
/// (rad) and bending curvature (1/m).
struct CurveReach {
  std::array<double, 2> tensile = {0, 0};
  double shear_rad = 0;
  double curvature_per_m = 0;
};

/// Fit of one Kawabata curve, in SI units: forces in N/m, moments in N.
struct CurveReport {
  std::string name;        ///< "tensile warp", "shear", "bending weft"
  int segments = 0;        ///< distinct slopes in the fit
  double first_slope = 0;  ///< N/m, N/(m rad) or N m
  double range = 0;        ///< largest fitted strain: ratio, rad or 1/m
  double rms_error = 0;
  double largest_error = 0;
  double half_hysteresis = 0;  ///< ignored where both branches are merged into one curve
};

/// Verdict of the independent checker.
struct CertificateCheck {
  bool accepted = false;
  double residual = 0;       ///< largest net force on a free point, in mean weights of a point
  double side_residual = 0;  ///< largest net moment of an edge over the mean edge length
  double deepest_m = 0;      ///< deepest penetration of the cloth into an object
  int crossings = 0;         ///< points where the cloth passes through itself
  int places = 0;            ///< contact points that press on the cloth
  std::vector<std::string> refused;  ///< reasons for refusal
};

/// Extremes of the cloth's strains.
struct CertificateStrains {
  Eigen::Vector2d warp = Eigen::Vector2d::Zero(), weft = Eigen::Vector2d::Zero();  ///< min, max
  double shear_most_rad = 0, curvature_most_per_m = 0;
};

struct CertificateDistances {
  std::optional<double> to_object_m;     ///< smallest distance of a point; absent without objects
  double to_table_m = 0;                 ///< smallest distance of a point
  std::optional<double> to_itself_m;     ///< absent if no part of the cloth is near another
  double deepest_m = 0;                  ///< deepest penetration between the mesh points
  int crossings = 0;                     ///< points where the cloth passes through itself
  double hold_error_m = 0;               ///< largest distance of a held point from its target
  std::optional<double> layers_apart_m;  ///< distance at which layers repel; absent if never
  int contact_forces = 0;                ///< number of rows in the contact_forces.csv beside it
};

struct CertificateEnergies {
  std::optional<double> start_j;  ///< sum of gravity, elastic, contact and kinetic energy
  double end_j = 0;
  double kinetic_j = 0;                       ///< kinetic energy at the end
  std::optional<double> internal_j;           ///< energy of the cloth alone, at the end
  std::optional<double> internal_friction_j;  ///< lost to internal friction; absent if it is off
  std::optional<double> viscous_j;            ///< energy lost to damping and air drag
};

/// Placement of the cloth at the start.
struct CertificateStart {
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;
  int marks = 0;  ///< number of measured marks that determined the placement
  double placement_rms_m = 0;
};

/// Solver steps of one mesh level.
struct CertificateLevel {
  double spacing_m = 0;
  int points = 0, steps = 0;
};

/// Options of the triangle cloth, with the solver steps on each level.
struct CertificateMesh {
  double spacing_m = 0, coarsest_m = 0;
  unsigned seed = 1;
  double thickness_m = 0;  ///< distance that layers of cloth keep; 0: layers do not interact
  std::vector<CertificateLevel> levels;
};

/// Options of the paper's particle grid.
struct CertificateGrid {
  int rows = 0, cols = 0;
  double damping_per_s = 0, air_drag_kg_per_m3 = 0;
  bool kinetic_damping = true;
  double step_fraction = 0;  ///< fraction of the largest stable step
  long steps = 0, most_steps = 0;
  int backtracked_steps = 0, kinetic_stops = 0;
  int clamped_springs = 0;  ///< springs whose tangent stiffness is clamped to 0 at the end
};

/// certificate.json: the claims of a simulated drape about itself, for others to check.
struct Certificate {
  bool at_rest = false;
  std::string status;  ///< "at rest", or why not
  /// Largest net force on a free point, in mean weights of a point; absent if the solver diverged.
  std::optional<double> residual;
  double residual_tolerance = 0;              ///< residual below which the drape counts as at rest
  std::optional<CertificateCheck> check;      ///< absent if not checked
  double time_s = 0;                          ///< duration of the fall
  std::optional<CertificateStrains> strains;  ///< absent if the solver diverged
  std::optional<CertificateDistances> distances;  ///< absent if the solver diverged
  std::optional<CertificateEnergies> energies;    ///< absent if the solver diverged
  CertificateStart start;
  double twist_n_m = 0;
  std::vector<CurveReport> curves;
  int segments = 0;                 ///< line segments per Kawabata curve
  std::optional<CurveReach> reach;  ///< absent if fitted over the whole measured range
  bool internal_friction = false;
  double friction = 0;  ///< coefficient between cloth and objects, and between layers of cloth
  std::variant<CertificateMesh, CertificateGrid> cloth;
  std::vector<std::string> warnings;
  Document document = {};
};
template <>
inline constexpr Format format_of<Certificate>{
    "certificate", Syntax::json, 2,
    "certificate.json: claims of a simulated drape about itself. It lies beside its sheet."};

void fields(Fields& f, CurveReach& reach);
void fields(Fields& f, CurveReport& curve);
void fields(Fields& f, Certificate& certificate);

/// Throws Error(bad_input) for a file that is not a certificate, and for a version 1 certificate,
/// which describes a particle grid that this version no longer simulates.
[[nodiscard]] Certificate read_certificate(const std::filesystem::path& file);

}  // namespace drape

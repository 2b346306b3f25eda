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

/// Strains up to which Kawabata curves are fitted: along warp and weft, by shear (rad) and bending
/// (1/m).
struct CurveReach {
  std::array<double, 2> tensile = {0, 0};
  double shear_rad = 0;
  double curvature_per_m = 0;
};

/// Approximation of one Kawabata curve; SI: forces in N/m, moments in N.
struct CurveReport {
  std::string name;        ///< "tensile warp", "shear", "bending weft"
  int segments = 0;        ///< distinct slopes used
  double first_slope = 0;  ///< N/m, N/(m rad) or N m
  double range = 0;        ///< strain, rad or 1/m
  double rms_error = 0;
  double largest_error = 0;
  double half_hysteresis = 0;  ///< hidden where the two branches are merged
};

/// Judgement of the independent checker.
struct CertificateCheck {
  bool accepted = false;
  double residual = 0;       ///< largest force left on a free point, in mean weights of a point
  double side_residual = 0;  ///< the same of the sides' moments, over the mean length of a side
  double deepest_m = 0;      ///< deepest cloth in an object
  int crossings = 0;         ///< places where the cloth passes through itself
  int places = 0;            ///< places where something presses on the cloth
  std::vector<std::string> refused;  ///< reasons
};

/// Extremes of the cloth's strains.
struct CertificateStrains {
  Eigen::Vector2d warp = Eigen::Vector2d::Zero(), weft = Eigen::Vector2d::Zero();  ///< least, most
  double shear_most_rad = 0, curvature_most_per_m = 0;
};

struct CertificateDistances {
  std::optional<double> to_object_m;     ///< least of a point; absent without objects
  double to_table_m = 0;                 ///< least of a point
  std::optional<double> to_itself_m;     ///< absent: nothing is near
  double deepest_m = 0;                  ///< between points inside an object
  int crossings = 0;                     ///< places where the cloth passes through itself
  double hold_error_m = 0;               ///< largest distance of a held point from its place
  std::optional<double> layers_apart_m;  ///< distance at which layers press; absent: never
  int contact_forces = 0;                ///< rows of contact_forces.csv beside it
};

struct CertificateEnergies {
  std::optional<double> start_j;  ///< gravity, elastic, contact and kinetic
  double end_j = 0;
  double kinetic_j = 0;                       ///< kinetic energy at the end
  std::optional<double> internal_j;           ///< energy of the cloth alone at the end
  std::optional<double> internal_friction_j;  ///< lost to it; absent: the option was off
  std::optional<double> viscous_j;            ///< lost to damping and air
};

/// Placement of the start.
struct CertificateStart {
  Eigen::Vector3d centre_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;
  int marks = 0;  ///< measured marks that placed it
  double placement_rms_m = 0;
};

/// Steps of one level's descents.
struct CertificateLevel {
  double spacing_m = 0;
  int points = 0, steps = 0;
};

/// Options of a cloth of triangles in levels, and its steps on each.
struct CertificateMesh {
  double spacing_m = 0, coarsest_m = 0;
  unsigned seed = 1;
  double thickness_m = 0;  ///< distance of layers that else cross; 0: they do not press
  std::vector<CertificateLevel> levels;
};

/// Options of the paper's particle grid.
struct CertificateGrid {
  int rows = 0, cols = 0;
  double damping_per_s = 0, air_drag_kg_per_m3 = 0;
  bool kinetic_damping = true;
  double step_fraction = 0;  ///< share of the stability limit
  long steps = 0, most_steps = 0;
  int backtracked_steps = 0, kinetic_stops = 0;
  int clamped_springs = 0;  ///< springs whose K'st is held at 0 in the end
};

/// certificate.json: claims of a simulated drape about itself, so that others can judge them.
struct Certificate {
  bool at_rest = false;
  std::string status;  ///< "at rest", or why not
  /// Largest force left on a free point, in mean weights of a point; absent: it diverged.
  std::optional<double> residual;
  double residual_tolerance = 0;                  ///< at which it counts as at rest
  std::optional<CertificateCheck> check;          ///< absent: not checked
  double time_s = 0;                              ///< duration of the fall
  std::optional<CertificateStrains> strains;      ///< absent: it diverged
  std::optional<CertificateDistances> distances;  ///< absent: it diverged
  std::optional<CertificateEnergies> energies;    ///< absent: it diverged
  CertificateStart start;
  double twist_n_m = 0;
  std::vector<CurveReport> curves;
  int segments = 0;                 ///< line segments per Kawabata curve
  std::optional<CurveReach> reach;  ///< absent: fitted wherever they are measured
  bool internal_friction = false;
  double friction = 0;  ///< coefficient between cloth and objects, and between layers
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

/// Throws Error(bad_input) for a file that is no certificate, and for one of version 1, which is of
/// a particle grid that this version does not simulate.
[[nodiscard]] Certificate read_certificate(const std::filesystem::path& file);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

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

/// One mesh in the hierarchy of nested levels of a drape.
struct DrapeLevelRecord {
  double spacing_m = 0;
  int points = 0;
  bool at_rest = false;
  std::string status;  ///< "at rest", or why not
  int steps = 0;
  std::optional<double> from_coarser_m;  ///< mean move from the next coarser mesh; absent on it
};

/// Position of a mark on the finest mesh, with a bound on its remaining mesh error.
struct LevelMark {
  MarkId mark;
  Eigen::Vector3d place_in_world = Eigen::Vector3d::Zero();
  double left_m = 0;  ///< largest distance from the limit of infinite mesh refinement
  std::optional<Eigen::Vector3d> from_coarser_m;  ///< move from the next coarser mesh, own branch
};

/// levels.json: the meshes of a drape from coarse to fine, with the remaining error of the finest.
/// It lies beside the drape's sheet.
struct LevelsFile {
  std::string sheet_sha256;  ///< SHA-256 of the sheet.json beside it
  std::vector<DrapeLevelRecord> levels;
  std::optional<double> left_m;  ///< mean over the marks; absent if not at rest or with one level
  std::vector<LevelMark> marks;
  Document document = {};
};
template <>
inline constexpr Format format_of<LevelsFile>{
    "levels", Syntax::json, 1,
    "levels.json: the meshes of a drape, and the error that the finest may leave."};

void fields(Fields& f, LevelsFile& file);

/// Sentence such as "mesh error up to 0.125 mm in the mean of the marks; `--spacing-mm 1.25` lowers
/// it", or the reason why the error is unknown.
[[nodiscard]] std::string mesh_error_sentence(const LevelsFile& file);

/// File name, beside the sheet of the drape that it describes.
inline constexpr const char* kSensitivityName = "sensitivity.json";

/// Displacement of the marks when a value is lowered and raised by `step`, one row per mark.
struct MarkMoves {
  double step = 0;  ///< in per cent for a fabric value, else in the unit of the value's name
  std::optional<double>
      half_width;  ///< half width of a stand-in's interval, which holds the true value; same unit
  Eigen::MatrixX3d down_m, up_m;
};

/// First-order effect on the drape of raising a fabric value by one per cent.
struct ValueEffect {
  std::string value;    ///< e.g. "bending_warp"
  double change_m = 0;  ///< change of the mean distance
  double moved_m = 0;   ///< mean displacement of the marks
  std::optional<MarkMoves> moves = std::nullopt;
};

/// First-order effect on the drape of raising a scene value by one unit.
struct SceneEffect {
  /// Name: "friction", "object_1_x_mm", "object_1_size_mm", "object_1_turn_deg", "pin_1_x_mm",
  /// "clamp_1_x_mm"; "level_x_deg": tilt of the bench about x; "curve_segments": from the fit to
  /// twenty per curve (1); "internal_friction": from off (0) to on (1), or the opposite (-1).
  std::string value;
  std::optional<double> change_m_per_unit = std::nullopt;  ///< change of the mean distance
  std::optional<MarkMoves> moves = std::nullopt;
  std::string absent = {};  ///< why `moves` is absent
};

/// The same drape with one part of the model changed.
struct VariantEffect {
  std::string what;        ///< e.g. "no twist stiffness"
  bool continued = false;  ///< started from the base's equilibrium and so on its branch
  bool at_rest = false;
  double distance_m = 0;  ///< mean over the marks
  double change_m = 0;    ///< change against the base
  double moved_m = 0;     ///< mean displacement of the marks relative to the base
};

/// sensitivity.json: response of a drape (the base) to each value of its fabric and scene.
struct SensitivityFile {
  Document document = {};
  std::optional<double> spacing_m;  ///< spacing of the base's finest mesh
  std::optional<int> rows, cols;    ///< particles of a base simulated on a grid by an older program
  int segments = 0;
  std::string model;
  std::string status = "at rest";  ///< the base: "at rest", or why not
  double distance_m = 0;           ///< mean distance of the base over the marks
  int marks = 0;
  std::vector<MarkId> marks_at;     ///< marks of the rows of each MarkMoves
  std::vector<ValueEffect> values;  ///< empty if the base has no first-order response
  std::vector<SceneEffect> scene;
  std::vector<VariantEffect> variants;
  std::optional<std::string> no_go = std::nullopt;  ///< why the reference or the start is NO-GO
};
template <>
inline constexpr Format format_of<SensitivityFile>{
    "sensitivity", Syntax::json, 1,
    "sensitivity.json: effects of fabric values, scene values and parts of the model on a drape."};

void fields(Fields& f, SensitivityFile& file);
/// Describes the marks of the rows of moves.
void marks_at(Fields& f, std::vector<MarkId>& marks);

/// One equilibrium shape among the several that a drape can have.
struct ListedBranch {
  int number = 0;       ///< rank by energy; branch 1 has the least
  std::string sheet;    ///< path from the folder of the list
  double energy_j = 0;  ///< on the coarsest mesh; only differences within one list are meaningful
  double residual = 0;  ///< largest net force on a free particle, in mean particle weights
  bool stable = true;   ///< false at a saddle point of the energy
  std::vector<int> starts;
  double fraction = 0;         ///< fraction of the starts
  std::optional<bool> sought;  ///< true if only the search found it: no start ended there
  double friction = 0;
  double farthest_member_m = 0;
  int hem_nodes = 0;                     ///< number of folds along the hem
  std::vector<double> hem_amplitudes_m;  ///< Fourier amplitudes of the hem's radius, orders 0 to 8
  std::optional<double> spacing_m;       ///< spacing of the mesh of `sheet`
  std::optional<double> polish_m;        ///< mean move of the marks from the coarsest mesh, if any
  std::string not_polished;              ///< why no refined equilibrium is given
};

/// Estimated probability that a further start ends on a branch not yet seen: the fraction of starts
/// that are alone on their branch (Good 1953, Good-Turing estimate).
struct UnseenBranches {
  int rests = 0;        ///< starts that ended in an equilibrium
  int seen_once = 0;    ///< branches reached by exactly one start
  double fraction = 0;  ///< seen_once / rests
  double upper95 = 1;   ///< its upper 95 % bound (Clopper and Pearson 1934); 3 / rests for none
};

struct RefusedStarts {
  std::vector<int> starts;
  std::string why;
};

/// Region of one mark in 95 % of an ensemble's drapes.
struct BandMark {
  MarkId mark;
  Eigen::Vector3d mean_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();   ///< 2.5 % quantile per axis
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();  ///< 97.5 % quantile per axis
  double radius95_m = 0;  ///< radius about the mean that holds 95 % of the drapes
};

/// Matrix of these moves, one row per mark.
[[nodiscard]] Eigen::MatrixX3d one_a_row(const std::vector<Eigen::Vector3d>& moves);

/// Another equilibrium of the scene's own drape, reached by a push or by another loading history.
struct OtherRest {
  std::string what;    ///< name of the loading history; empty for a push in a friction band
  std::string ending;  ///< "at rest", or why it counts for nothing
  std::optional<Eigen::Vector3d> push_per_weight;  ///< largest push in world axes, in cloth weights
  std::optional<std::vector<Eigen::Vector3d>> moves_m;  ///< move of each mark; absent if uncounted

  [[nodiscard]] Eigen::MatrixX3d moves() const;  ///< same moves, one row per mark
};

/// Range of one mark's positions over this equilibrium and all others, per axis.
struct MarkInterval {
  MarkId mark;
  Eigen::Vector3d rest_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d low_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_in_world = Eigen::Vector3d::Zero();
};

/// Range of positions in which friction holds the drape of the scene's start, sampled by pushes.
struct FrictionBand {
  double friction = 0;
  std::vector<OtherRest> pushes;     ///< each push grew and was released; empty without friction
  std::vector<OtherRest> ends = {};  ///< same start, with the scene's friction_ends()
  std::vector<MarkInterval> marks;

  [[nodiscard]] int counted() const;
  /// Largest displacement of each mark from its equilibrium after any push.
  [[nodiscard]] std::vector<double> reach_m() const;
};

/// Range of positions in which internal friction holds the drape, sampled by loading histories.
struct MemoryBand {
  std::optional<double> place_of_rest;  ///< 0 lowest, 1 highest; absent if no other end counts
  std::vector<OtherRest> ends;
  std::vector<MarkInterval> marks;

  /// Moves at the end with the lowest (highest) mean height; zero if that is the drape's own.
  [[nodiscard]] Eigen::MatrixX3d lowest_m() const { return extreme_m(-1); }
  [[nodiscard]] Eigen::MatrixX3d highest_m() const { return extreme_m(1); }

 private:
  [[nodiscard]] Eigen::MatrixX3d extreme_m(double sign) const;
};

/// Equilibrium of the scene's own start with errors in all stated values, and its displacement.
struct ErringRest {
  std::string ending;                                   ///< "at rest", or why it counts for nothing
  std::optional<std::vector<Eigen::Vector3d>> moves_m;  ///< per mark; absent if not counted
  std::optional<std::vector<Eigen::Vector3d>> first_order_m;  ///< first-order response, likewise
};

/// Such equilibria on the coarsest mesh, each with its own errors: effects of friction, folds and
/// edges beyond the first-order responses.
struct BeyondFirstOrder {
  std::vector<MarkId> marks_at;  ///< rows of the moves
  std::vector<ErringRest> rests;
};

/// Result of a start from the measured shape with another friction coefficient.
struct OtherFriction {
  double friction = 0;
  std::string ending;                ///< "at rest", or why it counts for nothing
  std::optional<double> distance_m;  ///< mean over the marks
};

/// Position of the measured drape relative to the branches.
struct PlacedDrape {
  std::optional<int> branch;  ///< absent if on no branch, or if it cannot be assigned (`reach_m`)
  std::optional<int> nearest;
  std::optional<double> distance_m;  ///< mean over the marks of the distance to the nearest member
  /// Distance below which a drape counts as on a branch. Absent for a single branch, or if the
  /// branches are no farther apart than that and the assignment is meaningless.
  std::optional<double> reach_m;
  std::optional<int> marks;
  std::optional<double> inside_fraction;  ///< fraction of the marks inside their bands
  std::string started_there;              ///< result of a start from the measured shape
  std::optional<double> started_there_m;  ///< mean distance to the measured drape after that start
  /// Starts from the measured shape at both ends of an unmeasured friction's range.
  std::vector<OtherFriction> other_frictions = {};
  std::optional<double> apart_m = {};  ///< distance between the nearest branch and the next one
};

/// branches.json: the equilibria of one drape, from an ensemble of starts.
struct BranchList {
  bool round = false;            ///< true if the scene is symmetric about a vertical axis
  double linked_m = 0;           ///< equilibria closer than this are one branch
  std::vector<int> not_at_rest;  ///< starts that did not come to rest
  std::vector<RefusedStarts> refused;
  std::vector<ListedBranch> branches;  ///< in order of energy, lowest first
  std::optional<int> starts;           ///< number of seeded starts; absent if not stated
  std::optional<UnseenBranches> unseen;
  std::optional<int> members_at_rest;  ///< absent if no ensemble was run
  std::vector<BandMark> band;          ///< empty for fewer than 20 members at rest
  std::optional<FrictionBand> friction_band;
  std::optional<MemoryBand> memory_band;
  std::optional<BeyondFirstOrder> beyond_first_order;
  std::optional<PlacedDrape> measured;
  Document document;
};
template <>
inline constexpr Format format_of<BranchList>{
    "branches", Syntax::json, 1,
    "branches.json: the equilibria of one drape, from an ensemble of starts."};

void fields(Fields& f, BranchList& list);

/// Simulated drape of one round specimen from one start.
struct CusickStart {
  std::string file;  ///< file name of its mesh
  int points = 0;
  double specimen_area_m2 = 0;
  bool at_rest = false;  ///< accepted by the checker
  int steps = 0;
  std::optional<double> residual = {};  ///< in mean weights of a point; absent if it diverged
  std::optional<double> energy_j = {};
  std::vector<std::string> refusals = {};  ///< the checker's reasons
  std::optional<double> checked_residual = {}, deepest_m = {};
  std::optional<double> dissipated_j = {};  ///< energy lost to internal friction
  int hurried_loads = 0;  ///< load steps that ended before the cloth was nearly at rest
};

/// cusick.json: drapes of one fabric between the discs of a drapemeter.
struct CusickFile {
  std::string fabric;
  std::optional<double> disc_m, specimen_m;  ///< diameters; absent in files of older programs
  std::vector<CusickStart> starts;
  Document document = {};
};
template <>
inline constexpr Format format_of<CusickFile>{
    "cusick", Syntax::json, 1, "cusick.json: virtual drapes of a round specimen from many starts."};

void fields(Fields& f, CusickFile& file);

}  // namespace drape

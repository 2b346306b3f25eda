// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// Result of comparing a virtual drape with the real one; none without a limit.
enum class Match { inside, outside, undecided, none };
template <>
inline constexpr std::string_view names_of<Match>[] = {"inside", "outside", "undecided", "none"};

/// A criterion of a match.
struct MatchBasis {
  std::string what;  ///< "tolerance", "repeats", "repeats: marks", "branch", "band" ...
  Match verdict = Match::undecided;
  std::optional<double> value, limit;  ///< in `unit`; inside if the value is at most the limit
  std::string unit = {};               ///< "mm" or "%"
  std::optional<double> p = {};        ///< probability that one more repeat deviates as far
  std::string reason = {};             ///< phrase for people
};
/// Equilibrium that the model reaches from the measured shape. It shows whether the model comes to
/// rest where the real cloth does, independently of the scene's start. Friction holds a cloth at
/// its start, so for unmeasured friction it is only given with its range.
struct ModelRest {
  double distance_m = 0;              ///< mean over the marks
  double least_m = 0, largest_m = 0;  ///< smallest and largest over the range of friction
  std::string range;                  ///< "friction 0.2 to 0.8"; empty if friction was measured
  std::vector<std::string> lost;      ///< ends of the range without equilibrium, with the reason
  std::optional<double> apart_m;     ///< mean distance from the headline; rotated on a round object
  std::optional<bool> other_branch;  ///< absent if no ensemble shows how far apart branches are
};

/// Decision by ISO 14253-1 and JCGM 106: inside if the value plus its total uncertainty is within
/// the limit, outside if the value minus it exceeds the limit, else undecided.
struct MatchVerdict {
  Match match = Match::none;
  std::string reason;
  std::string rests_on;  ///< basis: "8 repeats", "tolerance"; empty if none
  std::vector<MatchBasis> bases;
  std::optional<double> value_m;       ///< compared with the limit
  std::optional<double> limit_m;       ///< T: scatter of the repeats, or the rig's tolerance
  std::optional<double> error_number;  ///< E_n = d / U
  std::vector<std::string> remedies;   ///< each could change the decision
  std::optional<ModelRest> model;  ///< absent if the drape was not started from the measured shape
};

/// A laying of the drape, including its own, and whether the match is based on it.
struct RepeatLine {
  std::optional<std::size_t> input;  ///< index into DrapeInput::repeats; absent for its own sheet
  std::string set, repeat, face;     ///< face is empty if not stated
  std::string left_out;              ///< why it is not used as a repeat; empty if used
  std::optional<double> from_own_m;  ///< root mean square of the marks; absent for its own
};

/// A contribution to the uncertainty of a mean distance.
struct BudgetLine {
  std::string what;
  double u_m = 0;      ///< standard uncertainty of the mean distance due to this alone
  std::string origin;  ///< source of the value
  bool rectangular = false;
  std::string remedy = {};           ///< measure that reduces it; empty if none
  std::optional<double> own_m = {};  ///< bound of its effect, if it adds as a whole
};
struct Budget {
  std::vector<BudgetLine> lines;     ///< sorted, largest first
  std::vector<std::string> missing;  ///< unknown contributions, with measures to determine them
  double expanded_m = 0;             ///< U (95 %) of all lines
  double inputs_m = 0;               ///< of the lines without a bound
  double own_m = 0;  ///< sum of the bounds: mesh, segments, marks without a distance
};

/// A table of formatted cells; `names` include the units. Numbers are right-aligned in text.
struct Table {
  Table() = default;
  /// `numbers`: indices of the numeric columns.
  explicit Table(std::vector<std::string> columns, const std::vector<std::size_t>& numbers = {});

  std::string title;
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;
  std::vector<bool> numeric;              ///< true for a numeric column
  std::vector<std::string> headings;      ///< for people; `names` if empty
  std::optional<std::size_t> marked_row;  ///< shown in bold

  void add(std::vector<std::string> row) { rows.push_back(std::move(row)); }
  [[nodiscard]] std::optional<std::size_t> column(const std::string& name) const;
};

/// A table of a report, named like its .csv beside the report.
struct ReportedTable {
  std::string name;  ///< "real-vs-virtual", "trust"
  std::string note;  ///< meaning of its columns, for people; can be empty
  Table table;
};
void fields(Fields& f, ReportedTable& table);

/// Distance of the real marks from one simulation.
struct ReportedDistance {
  int marks = 0;
  double mean_m = 0;  ///< measure used by the paper
  double median_m = 0, rms_m = 0, p95_m = 0, max_m = 0;
  std::optional<double> sigma_mean_m;       ///< uncertainty of the mean due to the marks
  std::optional<double> low_m, high_m;      ///< 95 % interval of the mean over resampled marks
  std::optional<double> shape_m;            ///< mean after a rigid alignment
  std::optional<double> place_m, turn_rad;  ///< that alignment: shift of the centroid, and angle
};

/// One simulation of a drape.
struct ReportedSimulation {
  std::string label;  ///< "2.5 mm, 5 segments"
  std::string model, fabric, status;
  std::string simulator;  ///< other program that made it; empty for drapebench
  std::optional<int> segments, branch;
  std::optional<double> spacing_m;     ///< spacing of the finest mesh
  std::optional<double> mesh_error_m;  ///< bound of this mesh's error, mean over the marks
  bool from_measured = false;          ///< true if started from the measured shape
  ReportedDistance distance;
};

/// An equilibrium of a drape compared with the real cloth.
struct ReportedBranch {
  int number = 0;               ///< rank by energy, 1 is the lowest
  std::optional<double> share;  ///< fraction of the seeded starts
  bool nearest = false, stable = true;
  double mean_m = 0;
  std::optional<double> shape_m;
};
struct ReportedBranches {
  std::string label, sha256, sentence;
  std::vector<ReportedBranch> branches;
};

/// A mark of the print: measured, with its position on the simulation that represents the drape, or
/// a gap with its reason.
struct ReportedMark {
  int row = 0, col = 0;
  std::optional<Eigen::Vector3d> real_in_world, virtual_in_world;
  std::optional<double> distance_m, sigma_distance_m;
  std::optional<double> sigma_m;  ///< of the mark in its worst direction
  std::optional<int> views;
  std::optional<Eigen::Vector3d> band_in_world;  ///< centre of its band in the ensemble
  std::optional<double> band_radius_m;  ///< radius that contains 95 % of the ensemble's drapes
  std::string gap;                      ///< why it has no distance
};

/// A photograph of the drape with its overlay. Pixel centres are integers.
struct ReportedView {
  std::string camera;
  std::string picture;  ///< path relative to the report's folder; empty if none
  int width_px = 0, height_px = 0;
  Eigen::Vector4d crop_px = Eigen::Vector4d::Zero();  ///< u and v of two corners of the part shown
  /// Row, col, u and v of each visible mark, and u and v of its position on the virtual cloth.
  std::vector<std::vector<double>> marks;
  /// Lines of the virtual cloth as u, v, u, v ..., split by whether its printed side or its back
  /// faces the camera.
  std::vector<std::vector<double>> front, back;
};

/// Shapes to draw in space, rounded to a tenth of a millimetre.
struct ReportedShape {
  int rows = 0, cols = 0;         ///< number of rows and columns of the virtual cloth's points
  std::vector<double> cloth_mm;   ///< x, y, z of each point, row by row
  std::vector<double> object_mm;  ///< x, y, z of the four corners of each quad
};

/// Quality of the measurement of the real cloth.
struct Measurement {
  int marks = 0, gaps = 0;                            ///< marks with a position, and without
  std::optional<double> sigma_median_m, sigma_max_m;  ///< of one mark, in its worst direction
};

/// Results for one drape.
struct ReportedDrape {
  std::string name;   ///< letters, digits, `-` and `_`; also part of file names
  std::string label;  ///< name shown to people, unique within the run, such as "C (repeat 2)"
  std::string set, rig, fabric;
  std::string object;              ///< "box 128 x 128 x 40 mm"
  std::vector<std::string> no_go;  ///< reasons why the measurement is NO-GO, the first cause first
  Measurement measurement;
  std::string simulation;  ///< label of the one that represents the drape; empty if none
  std::optional<ReportedDistance> distance;  ///< distance from that simulation
  MatchVerdict match;
  std::optional<Budget> budget;     ///< uncertainty of that distance's mean
  std::string why, next;            ///< one sentence each; next is empty if nothing is to be done
  std::vector<std::string> facts;   ///< further sentences on mesh, branches, ensemble, friction
  std::vector<RepeatLine> repeats;  ///< own laying first; empty if the drape was laid once
  std::vector<ReportedSimulation> simulations;
  std::vector<ReportedBranches> branch_sets;
  std::vector<ReportedMark> marks;  ///< sorted by row and column
  std::vector<ReportedView> views;
  std::optional<ReportedShape> shape;
  std::vector<ReportedTable> tables;
};

/// Severity of a note: `stops` makes the measurement NO-GO, `asks` requires an action.
enum class Severity { stops, asks, informs };
template <>
inline constexpr std::string_view names_of<Severity>[] = {"stops", "asks", "informs"};

/// A warning or reason.
struct ReportedNote {
  Severity severity = Severity::informs;
  std::string kind;   ///< text common to notes that differ only in drape and numbers
  std::string drape;  ///< label of the drape; empty for the whole run
  std::string text;
};

struct ReportedCamera {
  std::string name;
  int points = 0;
  double rms_px = 0, max_px = 0;
  double rms_m = 0;  ///< RMS distance of the target points from their rays
  Eigen::Vector4d covered_px = Eigen::Vector4d::Zero();  ///< u and v of two corners, covered
  int width_px = 0, height_px = 0;
};
struct ReportedCalibration {
  std::string method, sha256, no_go;  ///< no_go is empty if GO
  int sets = 0;
  std::vector<ReportedCamera> cameras;
  std::vector<std::pair<std::string, std::string>> findings;  ///< figures from its program's ending
  std::vector<std::string> warnings;
};

struct ReportedInput {
  std::string file, sha256;  ///< path relative to the report's folder
};
/// Sources of the numbers.
struct ReportedProvenance {
  std::vector<ReportedInput> inputs;
  std::vector<std::string> programs, commands;  ///< commands to run in the report's folder
  std::vector<std::pair<std::string, std::string>> trees;  ///< by drape, traced to the photographs
  std::vector<std::string> recordings, stand_ins;
};

/// report.json: all results of a run, as shown by screen, page, tables and histories.
struct RunReport {
  std::string program;  ///< name and version
  std::string rig, label, operator_name, date, store;
  std::optional<int> run;  ///< number in the store
  bool go = true;
  std::string sentence;              ///< verdict in one sentence
  std::vector<std::string> reasons;  ///< reasons of a NO-GO, the first cause first
  std::vector<ReportedDrape> drapes;
  std::vector<ReportedTable> virtual_groups;  ///< pairs of simulations without a real cloth
  std::optional<ReportedCalibration> calibration;
  std::vector<ReportedNote> notes;  ///< sorted by severity
  ReportedProvenance provenance;
  Document document = {};
};
template <>
inline constexpr Format format_of<RunReport>{"report", Syntax::json, 1,
                                             "report.json: everything that a run found"};
void fields(Fields& f, RunReport& report);

/// Formats a number for people, rounded to the second significant digit of its uncertainty in the
/// same unit; without an uncertainty to three significant digits. Ties are rounded away from zero.
/// `core/page/figure.js` follows the same rule.
[[nodiscard]] std::string figure(double value, std::optional<double> uncertainty = std::nullopt);

/// Mean distance and U of a drape in mm as text, such as "20.6" and "2.2"; U is empty if unknown.
struct DistanceFigures {
  std::string mean, expanded, shape, place, turn, limit;  ///< mm, rotation in degrees
};
[[nodiscard]] DistanceFigures figures_of(const ReportedDrape& drape);

/// Summary of a drape in lines of at most 100 columns: name, match, distance and U, shape and
/// position, reason and next action.
[[nodiscard]] std::string ending_lines(const ReportedDrape& drape, std::size_t name_width);

/// Ending of a run: `first`, then the notes grouped by kind, each drape, and finally the location
/// of the page (`page` can be empty). Lines have at most 100 columns, except the first and last.
[[nodiscard]] std::string ending_text(const RunReport& report, const std::string& first,
                                      const std::string& page);
/// First line: "GO: bench1, run 1; 3 cameras, marks to 0.03 mm", or "NO-GO: " and the first cause.
[[nodiscard]] std::string first_line(const RunReport& report);
/// True if the run is GO and no drape is outside or undecided.
[[nodiscard]] bool is_all_good(const RunReport& report);
/// Full text for one drape.
[[nodiscard]] std::string detail_text(const ReportedDrape& drape);

/// Title, then columns padded to equal width.
[[nodiscard]] std::string text_of(const Table& table);

/// Beginning of a gap's reason, without details: "seen by one camera (cam2); ..." gives "seen by
/// one camera".
[[nodiscard]] std::string kind_of_gap(const std::string& reason);

}  // namespace drape

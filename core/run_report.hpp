// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/fields/records.hpp"

namespace drape {

/// A virtual drape beside the real one; none: there is no limit.
enum class Match { inside, outside, undecided, none };
template <>
inline constexpr std::string_view names_of<Match>[] = {"inside", "outside", "undecided", "none"};

/// One thing that a match is judged against.
struct MatchBasis {
  std::string what;  ///< "tolerance", "repeats", "repeats: marks", "branch", "band" ...
  Match verdict = Match::undecided;
  std::optional<double> value, limit;  ///< in `unit`; inside: value up to the limit
  std::string unit = {};               ///< "mm" or "%"
  std::optional<double> p = {};        ///< probability that one more repeat lies as far out
  std::string reason = {};             ///< one phrase for people
};
/// The rest that the model reaches from the measured shape: whether it rests where the real cloth
/// rests, whatever the scene's start leads to. More friction keeps a cloth where it starts, so it
/// is only given with the range over a friction that nobody measured.
struct ModelRest {
  double distance_m = 0;              ///< mean over the marks
  double least_m = 0, largest_m = 0;  ///< of it over the range, which holds it
  std::string range;                  ///< "friction 0.2 to 0.8"; empty: friction was measured
  std::vector<std::string> lost;      ///< ends of the range without a rest, and why
  std::optional<double> apart_m;      ///< mean distance from the headline; on a round object turned
  std::optional<bool> other_branch;   ///< absent: no ensemble says how far branches lie apart
};

/// Decision by ISO 14253-1 and JCGM 106: inside if the value with everything that is open is within
/// the limit, outside if without it it exceeds the limit, else undecided. None without a limit.
struct MatchVerdict {
  Match match = Match::none;
  std::string reason;
  std::string rests_on;  ///< "8 repeats", "tolerance"; empty: on nothing
  std::vector<MatchBasis> bases;
  std::optional<double> value_m;       ///< compared with the limit
  std::optional<double> limit_m;       ///< T: scatter of the repeats, else the rig's tolerance
  std::optional<double> error_number;  ///< E_n = d / U
  std::vector<std::string> remedies;   ///< each could change the answer
  std::optional<ModelRest> model;  ///< absent: the drape was not started from the measured shape
};

/// A laying of the drape, its own among them, and whether the match rests on it too.
struct RepeatLine {
  std::optional<std::size_t> input;  ///< index into DrapeInput::repeats; absent: its own sheet
  std::string set, repeat, face;     ///< face empty: not stated
  std::string left_out;              ///< why it is not among the repeats; empty: it is
  std::optional<double> from_own_m;  ///< root mean square of the marks; absent: its own
};

/// One contribution to the uncertainty of a mean distance.
struct BudgetLine {
  std::string what;
  double u_m = 0;      ///< standard uncertainty of the mean distance, where this alone errs
  std::string origin;  ///< source of the value
  bool rectangular = false;
  std::string remedy = {};           ///< lowers it; empty: nothing does
  std::optional<double> own_m = {};  ///< of the simulation's own error: bound of its effect
};
struct Budget {
  std::vector<BudgetLine> lines;     ///< the largest first
  std::vector<std::string> missing;  ///< unknown contributions, and what to do
  double expanded_m = 0;             ///< U (95 %): of all lines
  double inputs_m = 0;               ///< of the lines that are not the simulation's own error
  double own_m = 0;                  ///< bound of the simulation's own error
};

/// A table of finished cells; `names` carry the units. Numbers are right-aligned in text.
struct Table {
  Table() = default;
  /// `numbers`: places of the columns of numbers.
  explicit Table(std::vector<std::string> columns, const std::vector<std::size_t>& numbers = {});

  std::string title;
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;
  std::vector<bool> numeric;              ///< per column
  std::vector<std::string> headings;      ///< for people; `names` when empty
  std::optional<std::size_t> marked_row;  ///< shown in bold

  void add(std::vector<std::string> row) { rows.push_back(std::move(row)); }
  [[nodiscard]] std::optional<std::size_t> column(const std::string& name) const;
};

/// A table of a report: its name is that of its .csv beside the report.
struct ReportedTable {
  std::string name;  ///< "real-vs-virtual", "trust"
  std::string note;  ///< meaning of its columns, for people; may be empty
  Table table;
};
void fields(Fields& f, ReportedTable& table);

/// Distance of the real marks from one simulation.
struct ReportedDistance {
  int marks = 0;
  double mean_m = 0;  ///< the paper's measure
  double median_m = 0, rms_m = 0, p95_m = 0, max_m = 0;
  std::optional<double> sigma_mean_m;       ///< noise of the marks in the mean
  std::optional<double> low_m, high_m;      ///< 95 % of means over marks drawn again
  std::optional<double> shape_m;            ///< mean that one rigid move leaves
  std::optional<double> place_m, turn_rad;  ///< that move: way of the marks' middle, and angle
};

/// One simulation of a drape.
struct ReportedSimulation {
  std::string label;  ///< "2.5 mm, 5 segments"
  std::string model, fabric, status;
  std::string simulator;  ///< another program that made it; empty: drapebench
  std::optional<int> segments, branch;
  std::optional<double> spacing_m;     ///< of the finest mesh
  std::optional<double> mesh_error_m;  ///< bound of what this mesh leaves, mean over the marks
  bool from_measured = false;          ///< began in the measured shape
  ReportedDistance distance;
};

/// One equilibrium of a drape beside the real cloth.
struct ReportedBranch {
  int number = 0;               ///< 1 has the least energy
  std::optional<double> share;  ///< of the seeded starts
  bool nearest = false, stable = true;
  double mean_m = 0;
  std::optional<double> shape_m;
};
struct ReportedBranches {
  std::string label, sha256, sentence;
  std::vector<ReportedBranch> branches;
};

/// A mark of the print: measured, with its place on the simulation that speaks for the drape, or a
/// gap with its reason.
struct ReportedMark {
  int row = 0, col = 0;
  std::optional<Eigen::Vector3d> real_in_world, virtual_in_world;
  std::optional<double> distance_m, sigma_distance_m;
  std::optional<double> sigma_m;  ///< of the mark along its worst direction
  std::optional<int> views;
  std::optional<Eigen::Vector3d> band_in_world;  ///< middle of its band in the ensemble
  std::optional<double> band_radius_m;           ///< holds it in 95 % of the ensemble's drapes
  std::string gap;                               ///< why it has no distance
};

/// A photograph of the drape with what is drawn over it. Pixel centres at integers.
struct ReportedView {
  std::string camera;
  std::string picture;  ///< from the report's folder; empty: there is none
  int width_px = 0, height_px = 0;
  Eigen::Vector4d crop_px = Eigen::Vector4d::Zero();  ///< u and v of two corners: what is shown
  /// Row, col, u and v of each mark that was seen here, and u and v of its virtual place.
  std::vector<std::vector<double>> marks;
  /// Lines of the virtual cloth: u, v, u, v ... where its printed side faces the camera, and where
  /// its back does.
  std::vector<std::vector<double>> front, back;
};

/// Shapes to draw in space, to a tenth of a millimetre.
struct ReportedShape {
  int rows = 0, cols = 0;         ///< of the virtual cloth's points
  std::vector<double> cloth_mm;   ///< x, y, z of each, row by row
  std::vector<double> object_mm;  ///< x, y, z of the four corners of each quad
};

/// Everything found for one drape.
struct ReportedDrape {
  std::string name;   ///< letters, digits, `-` and `_`: also part of its files' names
  std::string label;  ///< as people call it
  std::string set, rig, fabric;
  std::string object;              ///< "box 128 x 128 x 40 mm"
  std::vector<std::string> no_go;  ///< why the measurement is NO-GO, the first cause first
  int measured_marks = 0, gaps = 0;
  std::optional<double> sigma_median_m, sigma_max_m;  ///< of one mark, along its worst direction
  std::string simulation;  ///< label of the one that speaks for the drape; empty: none
  std::optional<ReportedDistance> distance;  ///< of that simulation
  MatchVerdict match;
  std::optional<Budget> budget;    ///< U of that distance's mean
  std::string why, next;           ///< a sentence each, for people; next empty: nothing is asked
  std::vector<std::string> facts;  ///< further sentences on mesh, branches, ensemble, friction
  std::vector<RepeatLine> repeats;
  std::vector<ReportedSimulation> simulations;
  std::vector<ReportedBranches> branch_sets;
  std::vector<ReportedMark> marks;  ///< ordered by row and column
  std::vector<ReportedView> views;
  std::optional<ReportedShape> shape;
  std::vector<ReportedTable> tables;
};

/// Stops: makes the measurement NO-GO. Asks: names something to do. Informs: the rest.
enum class Severity { stops, asks, informs };
template <>
inline constexpr std::string_view names_of<Severity>[] = {"stops", "asks", "informs"};

/// One warning or reason.
struct ReportedNote {
  Severity severity = Severity::informs;
  std::string kind;   ///< the same for notes that differ in drape and numbers alone
  std::string drape;  ///< label; empty: the run
  std::string text;
};

struct ReportedCamera {
  std::string name;
  int points = 0;
  double rms_px = 0, max_px = 0;
  double rms_m = 0;                                      ///< of the target's points from their rays
  Eigen::Vector4d covered_px = Eigen::Vector4d::Zero();  ///< u and v of two corners
  int width_px = 0, height_px = 0;
};
struct ReportedCalibration {
  std::string method, sha256, no_go;  ///< no_go empty: GO
  int sets = 0;
  std::vector<ReportedCamera> cameras;
  std::vector<std::pair<std::string, std::string>> findings;  ///< as its program ended
  std::vector<std::string> warnings;
};

struct ReportedInput {
  std::string file, sha256;  ///< path from the report's folder
};
/// What the numbers were made from.
struct ReportedProvenance {
  std::vector<ReportedInput> inputs;
  std::vector<std::string> programs, commands;             ///< commands run in the report's folder
  std::vector<std::pair<std::string, std::string>> trees;  ///< by drape: back to the photographs
  std::vector<std::string> recordings, stand_ins;
};

/// report.json: everything that a run found. Screen, page, tables and histories show it.
struct RunReport {
  std::string program;  ///< name and version
  std::string rig, label, operator_name, date, store;
  std::optional<int> run;  ///< number in the store
  bool go = true;
  std::string sentence;              ///< verdict in one sentence
  std::vector<std::string> reasons;  ///< of NO-GO, the first cause first
  std::vector<ReportedDrape> drapes;
  std::vector<ReportedTable> virtual_groups;  ///< pairs of simulations without a real cloth
  std::optional<ReportedCalibration> calibration;
  std::vector<ReportedNote> notes;  ///< those that stop first, those that inform last
  ReportedProvenance provenance;
  Document document = {};
};
template <>
inline constexpr Format format_of<RunReport>{"report", Syntax::json, 1,
                                             "report.json: everything that a run found"};
void fields(Fields& f, RunReport& report);

/// A number as people read it: to the decimal place of the second significant digit of its
/// uncertainty, both in one unit; without an uncertainty to three significant digits. Ties go away
/// from zero. `core/page/figure.js` is the same rule.
[[nodiscard]] std::string figure(double value, std::optional<double> uncertainty = std::nullopt);

/// "20.6", "2.2": mean distance and U of a drape in mm; U empty where there is none.
struct DistanceFigures {
  std::string mean, expanded, shape, place, turn, limit;  ///< mm, turn in degrees
};
[[nodiscard]] DistanceFigures figures_of(const ReportedDrape& drape);

/// The drape in at most three lines of 100 columns: name, match, distance and U, shape and place,
/// why and what next.
[[nodiscard]] std::string ending_lines(const ReportedDrape& drape, std::size_t name_width);

/// The end of a run: `first`, then the notes folded by kind, then each drape, and last where the
/// page is (`page` may be empty). Lines have at most 100 columns but the first and the last.
[[nodiscard]] std::string ending_text(const RunReport& report, const std::string& first,
                                      const std::string& page);
/// "GO: bench1, run 1; 3 cameras, marks to 0.03 mm", or "NO-GO: " and the first cause.
[[nodiscard]] std::string first_line(const RunReport& report);
/// Whether everything is good: GO, and no drape outside or undecided.
[[nodiscard]] bool is_all_good(const RunReport& report);
/// All that people read of one drape.
[[nodiscard]] std::string detail_text(const ReportedDrape& drape);

/// Columns padded to one width, title above.
[[nodiscard]] std::string text_of(const Table& table);

/// The first words of a gap's reason, up to the details: "seen by one camera (cam2); ..." gives
/// "seen by one camera".
[[nodiscard]] std::string kind_of_gap(const std::string& reason);

}  // namespace drape

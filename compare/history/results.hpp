// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/records/provenance.hpp"
#include "compare/store/store.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// Filter on the rows of the store; empty members do not filter. Each comparison is listed with the
/// last of its runs that passes the filter. Functions with a filter throw Error(usage) for an
/// invalid date and for a value that does not occur in the store, naming those that do. Every
/// function in this file checks the hashes of the rows that it returns, and throws Error(bad_input)
/// if one is not as written; nothing is recomputed.
struct ResultFilter {
  std::string scene = {};
  std::string fabric = {};
  std::string grid = {};                 ///< "21x21" or "21"
  std::optional<double> spacing_m = {};  ///< spacing of the finest mesh
  std::optional<int> segments = {};
  std::string rig = {};
  std::string model = {};
  std::string simulator = {};
  std::string since = {};  ///< ISO date of the run or its beginning, inclusive;
                           ///< date of the recording if there is no run
  std::string until = {};
  std::string calibration = {};  ///< beginning of its hash, or part of its name
  std::optional<int> run = {};   ///< number of the run
  bool outdated = false;         ///< also lists what a later run replaced

  friend bool operator==(const ResultFilter&, const ResultFilter&) = default;
};

/// Answer to a question about the store: a summary sentence and its tables.
struct Answer {
  std::string sentence = {};
  std::vector<Table> tables = {};
  bool good = true;  ///< false if something moved, or if a file behind a number is not as it was
};

/// Name, unit and definition.
using Metric = std::tuple<std::string, std::string, std::string>;
[[nodiscard]] std::vector<Metric> metric_dictionary(const StoreReader& store);

/// Table and key (SHA-256) of a row of the store.
using StoredKey = std::tuple<std::string, std::string>;
/// The only row of these tables (each with a column sha256) whose key starts with `key`; by default
/// a comparison of marks or of a mesh without marks. Throws Error(usage) if there is none or more
/// than one.
[[nodiscard]] StoredKey stored_key(const StoreReader& store, const std::string& key,
                                   const std::vector<std::string>& tables = {"comparison",
                                                                             "surface_comparison"});

/// Throws Error(bad_input) if these comparisons (full keys), their sheets, marks or last run are
/// not as written.
void require_comparisons(const StoreReader& store, const std::set<std::string>& keys);

/// One row per run: number, date, label, verdicts and their basis.
[[nodiscard]] Table list_runs(const StoreReader& store, const ResultFilter& filter);

/// Throws Error(usage) for a number that no run has.
void require_run(const StoreReader& store, int number);

/// Differences between two runs: a sentence that names the values, a table of the values, and one
/// of their drapes with verdicts and distances. Throws Error(usage) for a number that no run has.
[[nodiscard]] Answer difference_of_runs(const StoreReader& store, int first, int second);

/// The headline distance of each drape over the runs as a function of the value of `key` ("fabric",
/// "friction", any key of a scene or fabric file), for all specimens or one as in TrendOptions.
/// Rows with equal `series` agree in every other value of scene, fabric, calibration, mesh and
/// segments; `otherwise` names the differences from the scene's first series. Throws Error(usage)
/// for a key that no run has.
[[nodiscard]] Table trend_by(const StoreReader& store, const std::string& key,
                             const std::string& specimen = {});

/// One row per comparison between a measured sheet and a simulation.
[[nodiscard]] Table list_results(const StoreReader& store, const ResultFilter& filter);

/// Everything known about one comparison, named by the beginning of its key: tables of its metrics
/// with unit and definition, of its provenance, and of the marks. Throws Error(usage) if none or
/// more than one comparison matches.
[[nodiscard]] Answer show_result(const StoreReader& store, const std::string& key);

/// The paper's two tables for each scene and measured sheet in the store, with simulator, fabric,
/// model and solver where they differ, branches and surfaces. Pairs are included if both
/// simulations pass the filter; empty tables are omitted.
[[nodiscard]] std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter);

/// A complete table or view. Throws Error(usage) that lists the existing ones.
[[nodiscard]] Table export_table(const StoreReader& store, const std::string& name);

/// The store as SQL text that recreates it; equal content gives equal text.
[[nodiscard]] std::string dump_sql(const StoreReader& store);

/// Column of a row `d` of v_run_drape: whether its U is complete or lacks a part of the budget.
inline constexpr const char* kUncertaintyIs =
    "(SELECT CASE k.budget_complete WHEN 1 THEN 'complete' WHEN 0 THEN 'at least' END FROM "
    "run_drape AS k WHERE k.run = d.run AND k.scene = d.scene AND substr(k.headline_sha256, 1, 12) "
    "= d.comparison) AS uncertainty_is";

/// "21x21" or "2.5 mm"; empty if the filter has neither.
[[nodiscard]] std::string discretisation_of(const ResultFilter& filter);

/// Rows selected by a filter, as parts of one query: v_comparison AS v, each row with the last of
/// its runs that passes the filter AS s (the columns of schema.hpp's state_query).
struct Selection {
  std::string from;
  std::string where = " WHERE 1";
  Cells parameters;  ///< parameters of both, in order

  /// Adds what the filter asks of columns named scene, fabric, discretisation, segments, rig,
  /// model and simulator.
  void add(const ResultFilter& filter);
};

/// Throws Error(usage) for an invalid date, and for a value that does not occur in the store,
/// naming those that do.
[[nodiscard]] Selection selection_of(const StoreReader& store, const ResultFilter& filter);

/// Query of the runs that were stored, or stored again, on the dates of the filter, or of its
/// single run; appends its parameters.
[[nodiscard]] std::string runs_of(const ResultFilter& filter, Cells& parameters);

/// File with this content (SHA-256), or one that had it when stored; for the mesh of another
/// simulator its description; nullopt if unknown.
[[nodiscard]] std::optional<std::filesystem::path> place_in(const StoreReader& store,
                                                            RecordBook& book,
                                                            const std::string& sha256);

/// Selection among numbers of the same name.
struct WhyOptions {
  std::optional<MarkId> mark = {};  ///< mark of a comparison, selecting a column of mark_error
  std::string camera = {};          ///< camera of a calibration
};

/// Origin of one number: a table of its value, definition and the rows from which it was computed,
/// and one of every file behind it down to photographs and curves, by the run records beside the
/// outputs. It is good if every file exists, unchanged and traced. The store knows the paths of the
/// sheets. `key` is the beginning of the key of a comparison, of a pair of simulations, of a sheet
/// (drapemeter and uncertainty) or of a calibration (residuals), `metric` one of its columns.
/// Throws Error(usage) for a key or metric that does not exist.
[[nodiscard]] Answer explain(const StoreReader& store, const std::string& key,
                             const std::string& metric, const WhyOptions& options = {});

/// Series of values in the order of the dates of their first runs (for acceptances, the dates
/// stated by operators), with the prediction from the earlier values.
struct TrendOptions {
  std::string specimen = {};  ///< "SCENE" or "SCENE/FABRIC" of the reference drape; empty for all
  int least_before = 5;       ///< number of earlier values needed to judge one
  double alarm_sigmas = 3;
};
struct Trend {
  Table table;     ///< series, value, mean and standard deviation of the earlier values, alarm
  int alarms = 0;  ///< number of series whose newest value raises an alarm
};
/// Calibration residual of each camera (RMS, px) and mean distance (mm) of each rig, scene, fabric,
/// discretisation and number of segments. A value raises an alarm if it is off the mean of the
/// earlier ones by more than alarm_sigmas times s sqrt(1 + 1/n), with s their standard deviation.
[[nodiscard]] Trend trend_of(const StoreReader& store, const TrendOptions& options);

/// Two comparisons side by side: a table of each metric with both values and their difference, and
/// one of the common marks. Throws Error(usage) for a key that does not exist.
[[nodiscard]] Answer difference_of(const StoreReader& store, const std::string& first,
                                   const std::string& second);

/// The paper's twelve tables, or those of one experiment: the published numbers of `published_csv`
/// beside every result of the same scene, grid and segments in the store, one column per measured
/// sheet and one for simulations without a real cloth (more if models or solvers differ); below
/// them the results of the mesh cloth on its finest mesh, once per scene. The last column names the
/// columns whose simulations are not at rest. Throws Error(usage) for an experiment that is not in
/// the paper.
[[nodiscard]] std::vector<Table> published_tables(const StoreReader& store,
                                                  const std::string& published_csv,
                                                  const std::string& experiment = {});

/// Movement of a mark between two calibrations, after removing the motion of the whole sheet.
struct MarkMove {
  MarkId mark;
  Eigen::Vector3d by_m;           ///< second minus first, without the rigid part
  Eigen::Matrix3d covariance_m2;  ///< covariance of the difference
  double chi2 = 0;

  [[nodiscard]] bool moved(std::size_t marks) const;
};

/// Noise common to two measurements of one set.
struct SharedNoise {
  bool detections = false;   ///< true for the same marks in the same pictures
  bool calibrating = false;  ///< true if both calibrations use the same pictures
};

/// Movements of the marks present in both sheets. The covariance of a difference excludes what both
/// have in common: with the same detections only the calibrations' parts of both covariances count
/// (the whole sheet's part, from its error budget); if these use the same pictures too, the
/// difference of the two parts counts (Hausman 1978), since the less accurate estimate has the
/// error of the other and more. Without a budget the full covariances count. A mark moved if chi
/// square with three degrees of freedom exceeds its upper 5 % point over all marks (Bonferroni).
struct SheetMoves {
  Pose<void, void> rigid;
  std::vector<MarkMove> marks;
};
/// Throws Error(bad_input) for fewer than three common marks.
[[nodiscard]] SheetMoves moves_between(const Sheet& first, const Sheet& second,
                                       const SharedNoise& shared);

/// Movements of the marks of every set that two runs measured in the same pictures: a table of the
/// sets and one of the marks; good if none moved. Sheets are taken from the store, even if a later
/// run replaced their files. Throws Error(usage) for a number that no run has or runs without a
/// common set; Error(bad_input) if a sheet is missing.
[[nodiscard]] Answer moved_marks(const StoreReader& store, int first, int second);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/store/store.hpp"

namespace drape::compare {

/// Filter on the rows of the store; empty parts do not filter. Each comparison is listed with
/// the last of its runs that the filter admits. Functions that take one throw Error(usage) for a
/// date that does not exist and for a value that nothing in the store has, naming those that it
/// has. Every function of this file checks the hashes of the rows that it answers from, and throws
/// Error(bad_input) where one is not as it was written; nothing is computed again.
struct ResultFilter {
  std::string scene = {};
  std::string fabric = {};
  std::string grid = {};                 ///< "21x21" or "21"
  std::optional<double> spacing_m = {};  ///< spacing of the finest mesh
  std::optional<int> segments = {};
  std::string rig = {};
  std::string model = {};
  std::string simulator = {};
  std::string since = {};  ///< ISO date of the run or its beginning, inclusive; of the recording
                           ///< where there is no run
  std::string until = {};
  std::string calibration = {};  ///< start of its hash, or part of its name
  std::optional<int> run = {};   ///< its number
  bool outdated = false;         ///< also what a later run replaced

  friend bool operator==(const ResultFilter&, const ResultFilter&) = default;
};

/// Name, unit and definition.
using Metric = std::tuple<std::string, std::string, std::string>;
[[nodiscard]] std::vector<Metric> metric_dictionary(const StoreReader& store);

/// A row of the store that has a key.
struct StoredKey {
  std::string table;
  std::string sha256;
};
/// The one row of these tables (each with a column sha256) whose key starts so; by default a
/// comparison of marks or of a mesh without marks. Throws Error(usage) when no or more than one
/// does.
[[nodiscard]] StoredKey stored_key(const StoreReader& store, const std::string& key,
                                   const std::vector<std::string>& tables = {"comparison",
                                                                             "surface_comparison"});

/// Throws Error(bad_input) where these comparisons (whole keys), their sheets, marks or last run
/// are not as they were written.
void require_comparisons(const StoreReader& store, const std::set<std::string>& keys);

/// The same for a comparison of marks alone.
[[nodiscard]] std::string full_key(const StoreReader& store, const std::string& key);

/// One row per run: number, date, label, verdicts, what it rests on.
[[nodiscard]] Table list_runs(const StoreReader& store, const ResultFilter& filter);

/// Throws Error(usage) for a number that no run has.
void require_run(const StoreReader& store, int number);

/// Differences between two runs: values, verdicts, distances; `sentence` names the values.
struct RunDifference {
  std::string sentence;
  Table values, drapes;
};
/// Throws Error(usage) for a number that no run has.
[[nodiscard]] RunDifference difference_of_runs(const StoreReader& store, int first, int second);

/// The headline distance of each drape over the runs by the value of `key` ("fabric", "friction",
/// any key of a scene or fabric file), of all specimens or one as in TrendOptions. Rows of one
/// `series` agree in every other value of scene, fabric, calibration, mesh and segments;
/// `otherwise` names what differs from the scene's first series. Throws Error(usage) for a key no
/// run has.
[[nodiscard]] Table trend_by(const StoreReader& store, const std::string& key,
                             const std::string& specimen = {});

/// One row per comparison between a measured sheet and a simulation.
[[nodiscard]] Table list_results(const StoreReader& store, const ResultFilter& filter);

/// All that the store knows of one comparison, named by the start of its key: its metrics with
/// unit and definition, its provenance, and the marks. Throws Error(usage) when no or more than
/// one comparison starts so.
struct ShownResult {
  Table metrics;
  Table provenance;
  Table marks;
};
[[nodiscard]] ShownResult show_result(const StoreReader& store, const std::string& key);

/// The paper's two tables for each scene and measured sheet in the store, with simulator, fabric,
/// model and solver where they differ, branches and surfaces. Of pairs those whose simulations the
/// filter admits both; a table without a row is left out.
[[nodiscard]] std::vector<Table> paper_tables(const StoreReader& store, const ResultFilter& filter);

/// A whole table or view. Throws Error(usage) listing what there is.
[[nodiscard]] Table export_table(const StoreReader& store, const std::string& name);

/// The store as SQL text that makes it again; equal content gives equal text.
[[nodiscard]] std::string dump_sql(const StoreReader& store);

/// Column of a row `d` of v_run_drape: whether its U is all of it, or lacks a part of the budget.
inline constexpr const char* kUncertaintyIs =
    "(SELECT CASE k.budget_complete WHEN 1 THEN 'complete' WHEN 0 THEN 'at least' END FROM "
    "run_drape AS k WHERE k.run = d.run AND k.scene = d.scene AND substr(k.headline_sha256, 1, 12) "
    "= d.comparison) AS uncertainty_is";

/// Columns of the view v_real_vs_virtual.
[[nodiscard]] std::string in_order();

/// "21x21" or "2.5 mm"; empty where the filter asks for neither.
[[nodiscard]] std::string discretisation_of(const ResultFilter& filter);

/// Rows that a filter selects, as parts of one query: v_comparison AS v, each row with the last of
/// its runs that the filter admits AS s (the columns of schema.hpp's state_query).
struct Selection {
  std::string from;
  std::string where = " WHERE 1";
  Cells parameters;  ///< parameters of both, in their order

  void add(const std::string& column, const Cell& value);
};

/// Throws Error(usage) for a date that does not exist, and for a value that no row of the store
/// has, naming those that it has.
[[nodiscard]] Selection selection_of(const StoreReader& store, const ResultFilter& filter);

/// The same check alone.
void check_filter(const StoreReader& store, const ResultFilter& filter);

/// "SCENE" or "SCENE/FABRIC" of a trend; empty: all.
void check_specimen(const StoreReader& store, const std::string& specimen);

/// The query of the runs that were stored, or stored again, on the dates of the filter, or of its
/// one run; with its parameters, which are appended.
[[nodiscard]] std::string runs_of(const ResultFilter& filter, Cells& parameters);

/// File that has content (SHA-256), one that had it when it was stored, or of another simulator's
/// mesh its description; nothing where the store does not know.
[[nodiscard]] std::optional<std::filesystem::path> place_in(const StoreReader& store,
                                                            RecordBook& book,
                                                            const std::string& sha256);

/// Choice among numbers of the same name.
struct WhyOptions {
  std::optional<MarkId> mark = {};  ///< mark of a comparison: a column of mark_error
  std::string camera = {};          ///< camera of a calibration
};

/// Origin of one number: its value and definition, the rows it was computed from, and every
/// file behind it down to photographs and curves, through the run records beside each output. The
/// store knows where the sheets lay. `key` is the start of the key of a comparison, of a
/// pair of simulations, of a sheet (drapemeter and uncertainty) or of a calibration (residuals),
/// `metric` one of its columns. Throws Error(usage) for a key or metric that does not exist.
struct Explanation {
  Table number;
  Table chain;
  bool complete = true;  ///< every file of the chain is there, unchanged and traced
};
[[nodiscard]] Explanation explain(const StoreReader& store, const std::string& key,
                                  const std::string& metric, const WhyOptions& options = {});

/// Series of values in the order of the dates of their first runs (acceptances: as their operators
/// state them), with what the ones before them predict.
struct TrendOptions {
  std::string specimen = {};  ///< "SCENE" or "SCENE/FABRIC": the reference drape; empty: all
  int least_before = 5;       ///< values needed before one can be judged
  double alarm_sigmas = 3;
};
struct Trend {
  Table table;     ///< series, value, mean and standard deviation of those before, alarm
  int alarms = 0;  ///< alarms of the newest value of each series
};
/// Calibration residual of each camera (RMS, px) and mean distance (mm) of each rig, scene, fabric,
/// discretisation and number of segments. A value is judged against the values before it: more than
/// alarm_sigmas times s sqrt(1 + 1/n) off their mean, s their standard deviation, is an alarm.
[[nodiscard]] Trend trend_of(const StoreReader& store, const TrendOptions& options);

/// Two comparisons side by side: each metric with both values and their difference, and the marks
/// that both have. Throws Error(usage) for a key that does not exist.
struct Difference {
  Table metrics, marks;
};
[[nodiscard]] Difference difference_of(const StoreReader& store, const std::string& first,
                                       const std::string& second);

/// The paper's twelve tables, or those of one experiment: the published numbers of `published_csv`
/// beside every result of the same scene, grid and segments in the store, one column per measured
/// sheet and one for simulations without a real cloth (more where models or solvers differ); below
/// them the cloth's on its finest mesh, once per scene. The last column names the columns whose
/// simulations are not at rest. Throws Error(usage) for an
/// experiment that the paper has not.
[[nodiscard]] std::vector<Table> published_tables(const StoreReader& store,
                                                  const std::string& published_csv,
                                                  const std::string& experiment = {});

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/store/store.hpp"

namespace drape::compare {

/// Which rows of the store are wanted; empty parts do not filter. Each comparison is listed with
/// the last of its runs that the filter admits. Functions that take one throw Error(usage) for a
/// date that does not exist and for a value that nothing in the store has, naming those that it
/// has.
struct ResultFilter {
  std::string scene = {};
  std::string fabric = {};
  std::string grid = {};  ///< "21x21" or "21"
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

/// The same for a comparison of marks alone.
[[nodiscard]] std::string full_key(const StoreReader& store, const std::string& key);

/// One row per run: number, date, label, verdicts, what it rests on.
[[nodiscard]] Table list_runs(const StoreReader& store, const ResultFilter& filter);

/// Throws Error(usage) for a number that no run has.
void require_run(const StoreReader& store, int number);

/// What differs between two runs: values, verdicts, distances; `sentence` names the values.
struct RunDifference {
  std::string sentence;
  Table values, drapes;
};
/// Throws Error(usage) for a number that no run has.
[[nodiscard]] RunDifference difference_of_runs(const StoreReader& store, int first, int second);

/// The headline distance of each drape over the runs, one series for each value of `key` ("fabric",
/// "friction", any key of a scene or fabric file), of all specimens or one as in TrendOptions.
/// Throws Error(usage) for a key no run has.
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

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape::compare {

struct RelationColumn {
  std::string name;
  std::string unit = {}, definition = {}, better = {};  ///< description of a metric, else empty
  int since = 0;  ///< store version that introduced it; NULL in older rows
};

/// Table of the store, described once: insertion, the dictionary of metrics, manifests, merging and
/// migrations iterate over its columns. A new column must be last.
struct Relation {
  std::string name, statement;  ///< statement that creates it
  std::vector<RelationColumn> columns;
};
[[nodiscard]] const std::vector<Relation>& relations();
[[nodiscard]] const Relation& relation(const std::string& name);

/// PRAGMA user_version: that of the newest column, table or view.
[[nodiscard]] constexpr int store_version() {
  return 11;
}
/// Increased by each version of the store that introduces or redefines a metric.
[[nodiscard]] constexpr int metrics_version() {
  return 2;
}

/// SQL for the discretisation "2.5 mm" or "21x21" of a simulation AS s.
inline constexpr const char* kDiscretisation =
    "coalesce(s.grid_rows || 'x' || s.grid_cols, format('%g mm', s.spacing_mm))";
/// SQL order of comparisons: own simulations before others', many segments before few, fine before
/// coarse.
inline constexpr const char* kInOrder =
    "ORDER BY scene, measured, simulator <> 'drapebench', segments DESC, spacing_mm IS NULL, "
    "spacing_mm, grid_rows DESC, model, solver, begins DESC, branch, comparison";

/// Statements that create views, indexes and triggers for existing tables.
[[nodiscard]] std::vector<std::string> surrounding_statements();

/// Query of the view v_state: for each comparison its last run, and whether that is the current one
/// for these photographs; one row for a comparison without a run as well. SQLite does not
/// materialise it if it is joined with few comparisons, unlike the view in a LEFT JOIN. `window`
/// restricts it to the last of some runs, e.g. " AND q.run = 5" or " AND q.date >= ?".
[[nodiscard]] std::string state_query(const std::string& window = {});

/// The same for each measured sheet, used for results without marks.
[[nodiscard]] std::string sheet_state_query();

}  // namespace drape::compare

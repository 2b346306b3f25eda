// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape::compare {

struct RelationColumn {
  std::string name;
  std::string unit, definition, better;  ///< description of a metric; else empty
  int since = 0;                         ///< store version that brought it; older rows have NULL
};

/// Table of the store, described once: insertion, the dictionary of metrics, manifests, merging and
/// migrations are walks over its columns. A new column stands last.
struct Relation {
  std::string name, statement;  ///< the statement that makes it
  std::vector<RelationColumn> columns;
};
[[nodiscard]] const std::vector<Relation>& relations();
[[nodiscard]] const Relation& relation(const std::string& name);

[[nodiscard]] int store_version();  ///< PRAGMA user_version: of the newest column
/// Raised by each version of the store that brought a metric.
[[nodiscard]] int metrics_version();

/// SQL of "2.5 mm" or "21x21" of a simulation AS s.
inline constexpr const char* kDiscretisation =
    "coalesce(s.grid_rows || 'x' || s.grid_cols, format('%g mm', s.spacing_mm))";
/// The same of simulations and of v_comparison: own before others', many segments before few, fine
/// before coarse.
inline constexpr const char* kFinestFirst =
    "simulator <> 'drapebench', segments DESC, spacing_mm IS NULL, spacing_mm, grid_rows DESC, "
    "model, solver, begins DESC";

/// The statements that make views, indexes and triggers around tables that are there.
[[nodiscard]] std::vector<std::string> surrounding_statements();

/// The query of the view v_state: of each comparison its last run, and whether that is the last
/// word on these photographs; one row for a comparison without a run as well. SQLite does not make
/// it whole where it is joined with few comparisons, as it would the view in a LEFT JOIN. `window`
/// takes the last of some runs only, e.g. " AND q.run = 5" or " AND q.date >= ?".
[[nodiscard]] std::string state_query(const std::string& window = {});

/// The same of each measured sheet, for what hangs on it without marks.
[[nodiscard]] std::string sheet_state_query();

}  // namespace drape::compare

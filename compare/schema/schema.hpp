// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace drape::compare {

/// The statements that make the tables of an empty store, and those that make the metric
/// dictionary, views, indexes and triggers around tables that are there.
[[nodiscard]] std::vector<std::string> table_statements();
[[nodiscard]] std::vector<std::string> surrounding_statements();

// Parts of these:
/// Views of comparisons, pairs, surfaces and branches, each after those that it reads.
[[nodiscard]] std::vector<std::string> view_statements();
/// Tables and views of runs.
[[nodiscard]] std::vector<std::string> run_table_statements();
[[nodiscard]] std::vector<std::string> run_view_statements();

/// The query of the view v_state: of each comparison its last run, and whether that is the last
/// word on these photographs; one row for a comparison without a run as well. SQLite does not make
/// it whole where it is joined with few comparisons, as it would the view in a LEFT JOIN. `window`
/// takes the last of some runs only, e.g. " AND q.run = 5" or " AND q.date >= ?".
[[nodiscard]] std::string state_query(const std::string& window = {});

/// The same of each measured sheet, for what hangs on it without marks.
[[nodiscard]] std::string sheet_state_query();

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "compare/history/results.hpp"

namespace drape::compare {

/// Column of a row `d` of v_run_drape: whether its U is all of it, or lacks a part of the budget.
inline constexpr const char* kUncertaintyIs =
    "(SELECT CASE k.budget_complete WHEN 1 THEN 'complete' WHEN 0 THEN 'at least' END FROM "
    "run_drape AS k WHERE k.run = d.run AND k.scene = d.scene AND substr(k.headline_sha256, 1, 12) "
    "= d.comparison) AS uncertainty_is";

/// As in the view v_real_vs_virtual.
inline constexpr const char* kOrder =
    " ORDER BY scene, measured, simulator <> 'drapebench', segments DESC, grid_rows DESC, model, "
    "solver, branch, comparison";

/// "21x21" of "21x21" or "21".
[[nodiscard]] std::string grid_text(const std::string& grid);

/// What a filter selects, as parts of one query: v_comparison AS v, each row with the last of its
/// runs that the filter admits AS s (the columns of schema.hpp's state_query).
struct Selection {
  std::string from;
  std::string where = " WHERE 1";
  Cells parameters;  ///< of both, in their order

  void add(const std::string& column, const Value& value);
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

}  // namespace drape::compare

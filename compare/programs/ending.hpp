// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/outcome.hpp"
#include "core/program/program.hpp"
#include "core/run_report.hpp"

namespace drape::compare {

/// Ending to keep in the run record.
[[nodiscard]] Ending ending_of(const RunReport& report, const Outcome& outcome);

/// Prints the ending as text, or report.json with the keys of the ending; returns the exit code.
int print_ending(const RunReport& report, const Ending& ending, const CommonOptions& common);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/outcome.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// The ending with the tables in front of it.
[[nodiscard]] Ending ending_of(const Session& session, const Outcome& outcome);

/// Prints it as text, or with all of the outcome as JSON; returns the exit code.
int print_ending(const Session& session, const Outcome& outcome, const Ending& ending,
                 const CommonOptions& common);

}  // namespace drape::compare

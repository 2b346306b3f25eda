// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/outcome.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// Tables and ending as people read them.
[[nodiscard]] std::string ending_text(const Session& session, const Outcome& outcome);

/// Prints tables and ending as text or JSON; returns the exit code.
int print_ending(const Session& session, const Outcome& outcome, const CommonOptions& common);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/store/outcome.hpp"
#include "core/program/program.hpp"

namespace drape::compare {

/// Prints tables and ending as text or JSON; returns the exit code.
int print_ending(const Session& session, const Outcome& outcome, const CommonOptions& common);

}  // namespace drape::compare

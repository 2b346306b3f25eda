// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/programs/results_commands.hpp"

namespace drape::compare {

/// Executes `drape results export` with the arguments of `command`; returns the exit code. Throws
/// Error(usage) for an option that does not apply to the format.
int export_store(const Command& command, const StoreReader& reader,
                 const ResultsArguments& arguments, const CommonOptions& common);

}  // namespace drape::compare

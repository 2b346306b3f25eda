// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/programs/results_commands.hpp"

namespace drape::compare {

/// Answers `drape results export`, whose words are `command`; returns the exit code. Throws
/// Error(usage) for an option that the format has no use for.
int export_store(const Command& command, const StoreReader& reader,
                 const ResultsArguments& arguments, const CommonOptions& common);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/programs/results_commands.hpp"

namespace drape::compare {

/// Writes tables as text, CSV or JSON to standard output or into a file.
void write(const ResultsArguments& arguments, const CommonOptions& common,
           const std::vector<const Table*>& tables);
void write_list(const ResultsArguments& arguments, const CommonOptions& common,
                const std::vector<Table>& tables);
void write(const ResultsArguments& arguments, const CommonOptions& common, const Table& table);

/// Throws Error(usage) if the output would overwrite the store or its signature.
void require_apart_from_store(const std::filesystem::path& out, const std::filesystem::path& store);

}  // namespace drape::compare

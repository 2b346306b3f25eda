// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/programs/results_commands.hpp"

namespace drape::compare {

/// Tables as text, CSV or JSON, on standard output or into a file.
void write(const ResultsArguments& arguments, const CommonOptions& common,
           const std::vector<const Table*>& tables);
void write_list(const ResultsArguments& arguments, const CommonOptions& common,
                const std::vector<Table>& tables);
void write(const ResultsArguments& arguments, const CommonOptions& common, const Table& table);

/// Throws Error(usage) where an answer would be written over the store or its signature.
void require_apart_from_store(const std::filesystem::path& out, const std::filesystem::path& store);

}  // namespace drape::compare

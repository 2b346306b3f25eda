// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace drape::simulate {

/// Folders `branch-NN` that the branches.json of an earlier run in `out` names. The list is written
/// before its sheets, so it names whatever a run that was ended left there. Throws Error(bad_input)
/// for a list that cannot be read.
[[nodiscard]] std::vector<std::filesystem::path> earlier_branches(const std::filesystem::path& out);

/// Folders `NxN` in `out` whose sheet says that it was carried over from a coarser grid: only
/// drape-simulate refine writes such.
[[nodiscard]] std::vector<std::filesystem::path> earlier_grids(const std::filesystem::path& out);

/// Files of a simulated sheet in its folder, sheet.json first.
[[nodiscard]] std::vector<std::filesystem::path> sheet_files(const std::filesystem::path& folder);

/// Removes a sheet and what is written with it, sheet_files(), and each folder that is empty
/// then. Links and other people's files stay.
void remove_sheets(const std::vector<std::filesystem::path>& folders);

}  // namespace drape::simulate

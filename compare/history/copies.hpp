// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "compare/store/inputs.hpp"

namespace drape::compare {

/// Copies every sheet of the session, and every list of branches, into `<store>.files/`, named by
/// its content, so that its comparisons can be recomputed when a later run has replaced the sheet
/// or a folder is gone. What is there already stays. Returns the copies.
std::vector<std::filesystem::path> keep_copies(const std::filesystem::path& store,
                                               const Session& session);

/// Takes over the copies that another store keeps. Returns them.
std::vector<std::filesystem::path> take_copies(const std::filesystem::path& store,
                                               const std::filesystem::path& other);

/// Where take_copies() puts what a seal of the other store calls so; empty where it is no copy.
[[nodiscard]] std::filesystem::path copy_of_same_name(const std::filesystem::path& store,
                                                      const std::filesystem::path& other,
                                                      const std::string& path);

/// True for a path that keep_copies() made.
[[nodiscard]] bool is_copy(const std::string& path);

}  // namespace drape::compare

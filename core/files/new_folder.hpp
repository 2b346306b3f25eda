// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace drape {

/// Writes files (name inside the folder, text) into a new folder: all of them, or none if a write
/// fails or `judge`, which gets the folder that holds them, throws. Remains of a killed program are
/// replaced. Throws Error(bad_input) if the folder exists.
void write_new_folder(const std::filesystem::path& folder,
                      const std::vector<std::pair<std::string, std::string>>& files,
                      const std::function<void(const std::filesystem::path&)>& judge = {});

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace drape {

/// Writes files (name inside the folder, text) into a new folder: all of them, or none if a write
/// fails or `judge` throws. `judge` gets the folder that holds them, under its temporary name, and
/// may add files to it. Remains of a killed program are replaced. Throws Error(bad_input) if the
/// folder exists or another program writes it.
void write_new_folder(const std::filesystem::path& folder,
                      const std::vector<std::pair<std::string, std::string>>& files,
                      const std::function<void(const std::filesystem::path&)>& judge = {});

}  // namespace drape

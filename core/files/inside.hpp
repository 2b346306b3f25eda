// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "core/error.hpp"

namespace drape {

/// Like write_durable, for a name found in a file; refuses the names that read_inside refuses.
void write_inside(const std::filesystem::path& folder, const std::string& name,
                  std::string_view content, const Where& where);

/// Throws Error(bad_input) for a link to a file that does not exist.
void require_target(const std::filesystem::path& file);

}  // namespace drape

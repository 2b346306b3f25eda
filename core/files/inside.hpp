// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "core/error.hpp"

namespace drape {

/// write_durable for a name that stands in a file: what read_inside would refuse is refused.
void write_inside(const std::filesystem::path& folder, const std::string& name,
                  std::string_view content, const Where& where);

}  // namespace drape

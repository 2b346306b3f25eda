// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace drape::console {

/// The files of the page by name, including three.js; the build embeds them in the
/// program.
[[nodiscard]] const std::map<std::string, std::string_view>& assets();

}  // namespace drape::console

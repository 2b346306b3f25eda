// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace drape::console {

/// The files of the page by name, those it shares with the report under "page/": the build writes
/// their text into the program.
[[nodiscard]] const std::map<std::string, std::string_view>& assets();

}  // namespace drape::console

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace drape::detect {

/// Refuses what would be found out after all frames are measured: an overlay folder (empty: none)
/// that is no folder. And a place inside the recording, which is what cameras left: a picture there
/// could be written over. Throws Error.
void require_apart(const std::filesystem::path& recording, const std::filesystem::path& out,
                   const std::filesystem::path& overlays);

}  // namespace drape::detect

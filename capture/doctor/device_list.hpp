// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "capture/device/camera.hpp"

namespace drape::capture {

/// Lists devices through a separate camera host, so that a crashing library does no harm here.
/// Takes about 1 s. Throws Error(device) if the host fails.
[[nodiscard]] std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program,
                                                    bool sizes = false);

}  // namespace drape::capture

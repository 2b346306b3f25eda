// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "capture/device/camera.hpp"

namespace drape::capture {

/// The devices that answer, asked by a camera host of its own, so that a library that aborts takes
/// nothing down. Takes about 1 s. Throws Error(device) when the host fails.
[[nodiscard]] std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program,
                                                    bool sizes = false);

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "capture/host/camera_host.hpp"
#include "capture/live/live_capture.hpp"

namespace drape::capture {

/// Converts a camera's frame to grey and depth, keeping the raw bytes if needed. A frame whose size
/// does not match its pixel format gets a fault and no pixels.
[[nodiscard]] LiveFrame develop(HostFrame frame, const std::string& pixel_format);

}  // namespace drape::capture

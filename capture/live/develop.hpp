// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "capture/host/camera_host.hpp"
#include "capture/live/live_capture.hpp"

namespace drape::capture {

/// Grey of a frame as it came from the camera, its depth and, where needed, its raw bytes. A frame
/// that does not hold what its pixel format says has a fault and no pixels.
[[nodiscard]] LiveFrame develop(HostFrame frame, const std::string& pixel_format);

}  // namespace drape::capture

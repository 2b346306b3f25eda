// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "capture/live/live_capture.hpp"
#include "capture/live/running.hpp"

namespace drape::capture {

/// Waits for something from a camera host, at most `timeout_s`; not while a frame is there.
void wait_for_hosts(const std::vector<Running>& cameras, double timeout_s);

/// Starts the host of every camera for the sync method, and waits until all are ready. What stands
/// against the method: a camera that refuses it, does not open, or whose clock it needs and cannot
/// be read. Then no frames are expected.
[[nodiscard]] std::optional<LiveFault> open_all(std::vector<Running>& cameras,
                                                const CamerasFile& file, SyncMethod method,
                                                double opening_s);

/// Frames of this capture can be paired by device time.
[[nodiscard]] bool has_clock(const Running& camera);

}  // namespace drape::capture

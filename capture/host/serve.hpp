// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/host/channel.hpp"

namespace drape::capture {

/// Makes this process die with its parent, ignore SIGINT, cap its memory and isolate itself.
void become_camera_host(int memory_limit_mb);

/// Runs the camera's side: opens the camera, obeys commands on `control` and passes frames through
/// the shared memory until the other side closes. Reports every 100 ms that it is alive. A fault of
/// the camera is sent as a message and ends the function; nothing is thrown.
void serve_camera(Descriptor control, Descriptor memory);

}  // namespace drape::capture

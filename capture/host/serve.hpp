// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/host/channel.hpp"

namespace drape::capture {

/// Ends this process with the one that started it, limits its memory and confines it.
void become_camera_host(int memory_limit_mb);

/// The camera's side: opens the camera it is given, obeys commands on `control` and passes frames
/// through the shared memory, until the other side closes. Says every 100 ms that it is alive.
/// Faults of the camera are sent as a message and end it; nothing is thrown.
void serve_camera(Descriptor control, Descriptor memory);

}  // namespace drape::capture

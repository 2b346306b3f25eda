// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::capture {

/// Gives up, for good, what a camera host does not need: all capabilities but those of the stream's
/// socket (CAP_NET_RAW, CAP_NET_ADMIN), new privileges, new programs and processes, other kinds of
/// sockets than a camera's, and the calls by which a kernel is attacked or other processes are
/// read. Whatever a camera's packets do to its library stays in this process. Returns false where
/// the kernel refuses.
bool isolate_camera_host();

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::capture {

/// Irrevocably drops what a camera host does not need: all capabilities except those for the
/// stream's socket (CAP_NET_RAW, CAP_NET_ADMIN), new privileges, programs and processes, other
/// types of sockets, and system calls used to attack the kernel or read other processes. An exploit
/// of the camera library by malicious packets stays in this process. Returns false if the kernel
/// refuses.
bool isolate_camera_host();

}  // namespace drape::capture

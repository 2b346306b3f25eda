// SPDX-License-Identifier: Apache-2.0
// Preloaded library that simulates a busy machine with Debian's small default receive buffer for
// sockets: the limit of this machine cannot be lowered for one program, and a reader that always
// runs in time needs no buffer.
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>

extern "C" int setsockopt(int socket, int level, int name, const void* value,
                          socklen_t size) noexcept {
  if (level == SOL_SOCKET && (name == SO_RCVBUF || name == SO_RCVBUFFORCE)) {
    errno = EPERM;
    return -1;
  }
  return static_cast<int>(::syscall(SYS_setsockopt, socket, level, name, value, size));
}

/// Used by Aravis to read a camera's packets: each call comes long after a frame was sent.
extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags,
                        timespec* patience) {
  ::usleep(50'000);
  return static_cast<int>(::syscall(SYS_recvmmsg, socket, messages, count, flags, patience));
}

// SPDX-License-Identifier: Apache-2.0
// Preloaded, it plays a busy machine on which a socket's receive buffer stays as small as Debian
// makes it: what this machine allows cannot be lowered for one program, and a reader that always
// gets its turn in time needs no buffer.
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

/// By which Aravis reads a camera's packets: each call comes long after a frame was sent.
extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags,
                        timespec* patience) {
  ::usleep(50'000);
  return static_cast<int>(::syscall(SYS_recvmmsg, socket, messages, count, flags, patience));
}

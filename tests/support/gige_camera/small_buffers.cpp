// SPDX-License-Identifier: Apache-2.0
// Preloaded, it plays a machine on which a socket's receive buffer stays as small as Debian makes
// it: what this machine allows cannot be lowered for one program.
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

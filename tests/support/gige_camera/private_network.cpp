// SPDX-License-Identifier: Apache-2.0
#include "tests/support/gige_camera/private_network.hpp"

#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace drape::test {
namespace {

std::string why(const std::string& what) {
  return what + ": " + std::strerror(errno);
}

void map_identity(unsigned uid, unsigned gid) {
  std::ofstream("/proc/self/setgroups") << "deny";
  std::ofstream("/proc/self/uid_map") << "0 " << uid << " 1";
  std::ofstream("/proc/self/gid_map") << "0 " << gid << " 1";
}

std::optional<std::string> bring_loopback_up() {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strncpy(request.ifr_name, "lo", IFNAMSIZ - 1);
  bool good = ::ioctl(descriptor, SIOCGIFFLAGS, &request) == 0;
  request.ifr_flags = static_cast<short>(request.ifr_flags | IFF_UP | IFF_RUNNING);
  good = good && ::ioctl(descriptor, SIOCSIFFLAGS, &request) == 0;
  const std::string reason = good ? "" : why("loopback cannot be brought up");
  ::close(descriptor);
  if (good) return std::nullopt;
  return reason;
}

}  // namespace

std::optional<std::string> enter_private_network() {
  static const std::optional<std::string> result = []() -> std::optional<std::string> {
    const unsigned uid = ::getuid(), gid = ::getgid();
    if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) == 0) {
      map_identity(uid, gid);
    } else if (::unshare(CLONE_NEWNET) != 0) {
      return why("no network namespace");
    }
    return bring_loopback_up();
  }();
  return result;
}

}  // namespace drape::test

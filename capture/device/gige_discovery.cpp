// SPDX-License-Identifier: Apache-2.0
#include "capture/device/gige_discovery.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>

#include "capture/device/camera.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kWait = std::chrono::milliseconds(1000);
// Discovery command with acknowledgement, no payload (GigE Vision 2.0).
constexpr std::array<std::uint8_t, 8> kDiscover = {0x42, 0x11, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01};
constexpr std::size_t kHeader = 8, kAddress = 0x24, kSerial = 0xD8, kSerialBytes = 16;

/// Sockets that may send to everybody, one per address of this machine.
class Sockets {
 public:
  Sockets() {
    ifaddrs* all = nullptr;
    if (::getifaddrs(&all) != 0) return;
    for (const ifaddrs* a = all; a != nullptr; a = a->ifa_next) {
      if (a->ifa_addr == nullptr || a->ifa_addr->sa_family != AF_INET) continue;
      if ((a->ifa_flags & IFF_UP) == 0) continue;
      ask_from(*reinterpret_cast<const sockaddr_in*>(a->ifa_addr));
    }
    ::freeifaddrs(all);
  }
  ~Sockets() {
    for (const pollfd& s : sockets_) ::close(s.fd);
  }
  Sockets(const Sockets&) = delete;
  Sockets& operator=(const Sockets&) = delete;

  /// The next answer before `until`; empty when none comes.
  std::vector<std::uint8_t> next(Clock::time_point until) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now()).count();
    if (left <= 0 || ::poll(sockets_.data(), sockets_.size(), static_cast<int>(left)) <= 0)
      return {};
    for (const pollfd& s : sockets_) {
      if ((s.revents & POLLIN) == 0) continue;
      std::vector<std::uint8_t> bytes(2048);
      const ssize_t got = ::recv(s.fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
      bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 1);
      return bytes;
    }
    return {};
  }

 private:
  void ask_from(sockaddr_in from) {
    const int s = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (s < 0) return;
    sockets_.push_back({s, POLLIN, 0});
    const int yes = 1;
    ::setsockopt(s, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
    from.sin_port = 0;
    // Not bound, it asks from the address that the route has.
    std::ignore = ::bind(s, reinterpret_cast<const sockaddr*>(&from), sizeof from);
    sockaddr_in everybody{};
    everybody.sin_family = AF_INET;
    everybody.sin_port = htons(kControlPort);
    everybody.sin_addr.s_addr = INADDR_BROADCAST;
    ::sendto(s, kDiscover.data(), kDiscover.size(), 0,
             reinterpret_cast<const sockaddr*>(&everybody), sizeof everybody);
  }

  std::vector<pollfd> sockets_;
};

std::string text_at(const std::vector<std::uint8_t>& bytes, std::size_t at, std::size_t length) {
  const auto* from = reinterpret_cast<const char*>(bytes.data() + at);
  return {from, ::strnlen(from, length)};
}

}  // namespace

std::vector<GigeAnswer> gige_cameras() {
  Sockets sockets;
  const Clock::time_point until = Clock::now() + kWait;
  std::vector<GigeAnswer> found;
  for (auto bytes = sockets.next(until); !bytes.empty(); bytes = sockets.next(until)) {
    if (bytes.size() < kHeader + kSerial + kSerialBytes) continue;
    char address[INET_ADDRSTRLEN] = {};
    ::inet_ntop(AF_INET, bytes.data() + kHeader + kAddress, address, sizeof address);
    found.push_back({address, text_at(bytes, kHeader + kSerial, kSerialBytes)});
  }
  std::sort(found.begin(), found.end(),
            [](const GigeAnswer& a, const GigeAnswer& b) { return a.address < b.address; });
  const auto same = [](const GigeAnswer& a, const GigeAnswer& b) { return a.address == b.address; };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  return found;
}

void require_own_address(const std::string& address, const std::string& device) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const bool good = ::inet_pton(AF_INET, address.c_str(), &own.sin_addr) == 1 &&
                    ::bind(descriptor, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0;
  ::close(descriptor);
  if (good) return;
  throw device_error("no network card of this machine has the address " + address, device,
                     "plug the camera into the right network card, or correct host_address");
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#include "capture/device/socket_filter.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <sys/socket.h>

#include <charconv>
#include <filesystem>

namespace drape::capture {
namespace {

constexpr std::uint32_t kSourceAddress = 12;  ///< in the IPv4 header
constexpr std::uint32_t kSourcePort = 0;      ///< in the UDP header, where a UDP filter starts

sock_filter load(std::uint16_t size, std::uint32_t from) {
  return {static_cast<std::uint16_t>(BPF_LD | size | BPF_ABS), 0, 0, from};
}

sock_filter skip_unless(std::uint32_t value, std::uint8_t steps) {
  return {BPF_JMP | BPF_JEQ | BPF_K, 0, steps, value};
}

sock_filter give(std::uint32_t bytes) {
  return {BPF_RET | BPF_K, 0, 0, bytes};
}

}  // namespace

std::vector<int> udp_sockets() {
  std::vector<int> sockets;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const std::string name = entry.path().filename().string();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    int type = 0, domain = 0;
    socklen_t size = sizeof type;
    if (::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) != 0) continue;
    ::getsockopt(descriptor, SOL_SOCKET, SO_DOMAIN, &domain, &size);
    if (type == SOCK_DGRAM && domain == AF_INET) sockets.push_back(descriptor);
  }
  return sockets;
}

bool accept_only(int socket, const std::string& ip_address, std::uint16_t port) {
  in_addr address{};
  if (::inet_pton(AF_INET, ip_address.c_str(), &address) != 1) return false;
  const auto ip_header = static_cast<std::uint32_t>(SKF_NET_OFF);
  std::vector<sock_filter> program;
  program.push_back(load(BPF_W, ip_header + kSourceAddress));
  program.push_back(skip_unless(ntohl(address.s_addr), port == 0 ? 1 : 3));
  if (port != 0) {
    program.push_back(load(BPF_H, kSourcePort));
    program.push_back(skip_unless(port, 1));
  }
  program.push_back(give(0xFFFFFFFF));
  program.push_back(give(0));
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return ::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) == 0;
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#include "capture/device/stream_socket.hpp"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
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

sock_filter answer(std::uint32_t bytes) {
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
  program.push_back(answer(0xFFFFFFFF));
  program.push_back(answer(0));
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return ::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) == 0;
}

std::size_t receive_buffer_for(std::size_t payload_bytes, std::size_t packet_size_bytes) {
  constexpr std::size_t headers = 36;       // IP, UDP and GVSP, part of the packet size
  constexpr std::size_t around = 384;       // skb_shared_info and room for the link's header
  constexpr std::size_t description = 256;  // sk_buff
  const std::size_t data = packet_size_bytes > headers ? packet_size_bytes - headers : 1;
  const std::size_t packets = payload_bytes / data + 3;  // leader, trailer, a broken one
  return packets * (std::bit_ceil(packet_size_bytes + around) + description);
}

std::size_t set_receive_buffer(int socket, std::size_t bytes) {
  // The kernel doubles what it is asked for, to make room for its own descriptions.
  const int half = static_cast<int>(std::min<std::size_t>(bytes / 2, 1U << 30U));
  if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &half, sizeof half) != 0)
    ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &half, sizeof half);
  int got = 0;
  socklen_t size = sizeof got;
  if (::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &got, &size) != 0) return 0;
  return static_cast<std::size_t>(got);
}

std::size_t reachable_receive_buffer(std::size_t bytes) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return 0;
  const std::size_t got = set_receive_buffer(socket, bytes);
  ::close(socket);
  return got;
}

bool may_open_packet_socket() {
  const int socket = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
  if (socket >= 0) ::close(socket);
  return socket >= 0;
}

}  // namespace drape::capture

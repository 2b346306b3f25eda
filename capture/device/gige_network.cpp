// SPDX-License-Identifier: Apache-2.0
#include "capture/device/gige_network.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kDiscovery = std::chrono::milliseconds(1000);
// Discovery command with acknowledgement, no payload (GigE Vision 2.0).
constexpr std::array<std::uint8_t, 8> kDiscover = {0x42, 0x11, 0x00, 0x02, 0x00, 0x00, 0x00, 0x01};
constexpr std::size_t kHeader = 8, kAddress = 0x24, kSerial = 0xD8, kSerialBytes = 16;
constexpr std::uint32_t kSourceAddress = 12;  ///< offset in the IPv4 header
constexpr std::uint32_t kSourcePort = 0;      ///< offset in the UDP header, where UDP filters start

std::optional<in_addr> address_in(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return address;
}

Descriptor udp_socket() {
  return Descriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
}

bool bind_to(const Descriptor& socket, in_addr address) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr = address;
  return ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0;
}

template <class Bytes>
bool send_to(const Descriptor& socket, const Bytes& datagram, in_addr address) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kControlPort);
  to.sin_addr = address;
  return ::sendto(socket.get(), datagram.data(), datagram.size(), 0,
                  reinterpret_cast<const sockaddr*>(&to),
                  sizeof to) == static_cast<ssize_t>(datagram.size());
}

void put(std::vector<std::uint8_t>& to, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

in_addr action_address(const std::string& text) {
  if (const auto address = address_in(text)) return *address;
  throw Error(ErrorKind::device, "`" + text + "` is no IP address", {},
              "action commands need GigE Vision cameras");
}

}  // namespace

std::vector<NetworkCard> network_cards() {
  std::vector<NetworkCard> cards;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return cards;
  for (const ifaddrs* a = all; a != nullptr; a = a->ifa_next) {
    if (a->ifa_addr == nullptr || a->ifa_netmask == nullptr || a->ifa_addr->sa_family != AF_INET)
      continue;
    const std::string name = a->ifa_name;
    cards.push_back({name.substr(0, name.find(':')),
                     reinterpret_cast<const sockaddr_in*>(a->ifa_addr)->sin_addr,
                     reinterpret_cast<const sockaddr_in*>(a->ifa_netmask)->sin_addr,
                     (a->ifa_flags & IFF_UP) != 0});
  }
  ::freeifaddrs(all);
  return cards;
}

std::map<std::string, std::string> gige_cameras() {
  std::vector<Descriptor> sockets;
  std::vector<pollfd> waiting;
  for (const NetworkCard& card : network_cards()) {
    if (!card.up) continue;
    const Descriptor& s = sockets.emplace_back(udp_socket());
    const int yes = 1;
    ::setsockopt(s.get(), SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
    bind_to(s, card.address);  // if not bound, it uses the route's source address
    send_to(s, kDiscover, {INADDR_BROADCAST});
    waiting.push_back({s.get(), POLLIN, 0});
  }
  const auto until = Clock::now() + kDiscovery;
  std::map<std::string, std::string> found;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - Clock::now());
    if (left.count() <= 0 ||
        ::poll(waiting.data(), waiting.size(), static_cast<int>(left.count())) <= 0)
      break;
    for (const pollfd& s : waiting) {
      std::array<char, 2048> bytes;
      const ssize_t got = ::recv(s.fd, bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (got < static_cast<ssize_t>(kHeader + kSerial + kSerialBytes)) continue;
      char address[INET_ADDRSTRLEN] = {};
      ::inet_ntop(AF_INET, bytes.data() + kHeader + kAddress, address, sizeof address);
      const char* serial = bytes.data() + kHeader + kSerial;
      found.try_emplace(address, serial, ::strnlen(serial, kSerialBytes));
    }
  }
  return found;
}

void require_own_address(const std::string& address, const std::string& device) {
  const auto own = address_in(address);
  if (own && bind_to(udp_socket(), *own)) return;
  throw device_error("no network card of this machine has the address " + address, device,
                     "plug the camera into the right network card, or correct host_address");
}

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
  const auto address = address_in(ip_address);
  if (!address) return false;
  const auto ip_header = static_cast<std::uint32_t>(SKF_NET_OFF);
  const auto skip_unless = [](std::uint32_t value, std::uint8_t steps) -> sock_filter {
    return BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, value, 0, steps);
  };
  std::vector<sock_filter> program = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, ip_header + kSourceAddress),
      skip_unless(ntohl(address->s_addr), port == 0 ? 1 : 3),
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, kSourcePort),
      skip_unless(port, 1),
      BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFF),
      BPF_STMT(BPF_RET | BPF_K, 0)};
  if (port == 0) program.erase(program.begin() + 2, program.begin() + 4);
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  return ::setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) == 0;
}

std::size_t receive_buffer_for(std::size_t payload_bytes, std::size_t packet_size_bytes) {
  constexpr std::size_t headers = 36;       // IP, UDP and GVSP headers, included in the packet size
  constexpr std::size_t around = 384;       // skb_shared_info and space for the link header
  constexpr std::size_t description = 256;  // sk_buff
  const std::size_t data = packet_size_bytes > headers ? packet_size_bytes - headers : 1;
  const std::size_t packets = payload_bytes / data + 3;  // leader, trailer, a partial one
  return packets * (std::bit_ceil(packet_size_bytes + around) + description);
}

std::size_t set_receive_buffer(int socket, std::size_t bytes) {
  // The kernel doubles the requested size, to make room for its own descriptors.
  const int half = static_cast<int>(std::min<std::size_t>(bytes / 2, 1U << 30U));
  if (::setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &half, sizeof half) != 0)
    ::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &half, sizeof half);
  int got = 0;
  socklen_t size = sizeof got;
  if (::getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &got, &size) != 0) return 0;
  return static_cast<std::size_t>(got);
}

std::size_t reachable_receive_buffer(std::size_t bytes) {
  return set_receive_buffer(udp_socket().get(), bytes);
}

bool may_open_packet_socket() {
  return Descriptor(::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0)).get() >= 0;
}

ActionSender::ActionSender(const std::string& host_address) : socket_(udp_socket()) {
  if (bind_to(socket_, action_address(host_address))) return;
  throw Error(ErrorKind::device, "no socket for action commands on " + host_address, {},
              "check the address of the network card");
}

/// Sends the command as one datagram (GigE Vision 2.0, ACTION_CMD).
bool ActionSender::send(const std::string& camera_address,
                        std::optional<std::int64_t> device_ticks) {
  request_id_ = static_cast<std::uint16_t>(request_id_ % 65535 + 1);
  const ActionKeys keys;
  constexpr std::uint8_t command_key = 0x42, scheduled = 0x80;
  constexpr std::uint16_t action_command = 0x0100;
  std::vector<std::uint8_t> datagram = {command_key, device_ticks ? scheduled : std::uint8_t{0}};
  put(datagram, action_command, 2);
  put(datagram, device_ticks ? 20 : 12, 2);
  put(datagram, request_id_, 2);
  put(datagram, keys.device_key, 4);
  put(datagram, keys.group_key, 4);
  put(datagram, keys.group_mask, 4);
  if (device_ticks) put(datagram, static_cast<std::uint64_t>(*device_ticks), 8);
  return send_to(socket_, datagram, action_address(camera_address));
}

}  // namespace drape::capture

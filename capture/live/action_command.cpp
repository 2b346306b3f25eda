// SPDX-License-Identifier: Apache-2.0
#include "capture/live/action_command.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr std::uint8_t kCommandKey = 0x42, kScheduledFlag = 0x80;
constexpr std::uint16_t kActionCommand = 0x0100;

void put(std::vector<std::uint8_t>& to, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) to.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

sockaddr_in endpoint(const std::string& address, std::uint16_t port) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(port);
  if (::inet_pton(AF_INET, address.c_str(), &result.sin_addr) != 1)
    throw Error(ErrorKind::device, "`" + address + "` is no IP address", {},
                "action commands need GigE Vision cameras");
  return result;
}

}  // namespace

std::vector<std::uint8_t> action_datagram(const ActionKeys& keys, std::uint16_t request_id,
                                          std::optional<std::int64_t> device_ticks) {
  std::vector<std::uint8_t> datagram = {kCommandKey,
                                        device_ticks ? kScheduledFlag : std::uint8_t{0}};
  put(datagram, kActionCommand, 2);
  put(datagram, device_ticks ? 20 : 12, 2);
  put(datagram, request_id, 2);
  put(datagram, keys.device_key, 4);
  put(datagram, keys.group_key, 4);
  put(datagram, keys.group_mask, 4);
  if (device_ticks) put(datagram, static_cast<std::uint64_t>(*device_ticks), 8);
  return datagram;
}

ActionSender::ActionSender(const std::string& host_address) {
  const sockaddr_in from = endpoint(host_address, 0);
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket_ >= 0 && ::bind(socket_, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0)
    return;
  if (socket_ >= 0) ::close(socket_);
  throw Error(ErrorKind::device, "no socket for action commands on " + host_address, {},
              "check the address of the network card");
}

ActionSender::~ActionSender() {
  ::close(socket_);
}

bool ActionSender::send(const std::string& camera_address,
                        std::optional<std::int64_t> device_ticks) {
  request_id_ =
      request_id_ == 65535 ? std::uint16_t{1} : static_cast<std::uint16_t>(request_id_ + 1);
  const auto datagram = action_datagram({}, request_id_, device_ticks);
  const sockaddr_in to = endpoint(camera_address, kControlPort);
  return ::sendto(socket_, datagram.data(), datagram.size(), 0,
                  reinterpret_cast<const sockaddr*>(&to),
                  sizeof to) == static_cast<ssize_t>(datagram.size());
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/host/channel.hpp"

// Sockets of GigE Vision beside those of Aravis: discovery, filters and buffers of its streams, and
// action commands, for which it has no call.
namespace drape::capture {

/// Port of GVCP, the control protocol (GigE Vision 2.0).
inline constexpr std::uint16_t kControlPort = 3956;

/// An IPv4 address of this machine.
struct NetworkCard {
  std::string name;  ///< without an alias
  in_addr address, mask;
  bool up = false;
};
[[nodiscard]] std::vector<NetworkCard> network_cards();

/// Answer of a GigE Vision camera to discovery.
struct GigeAnswer {
  std::string address, serial;
};

/// Asks on every network card and gathers the answers of one second, in order of their addresses.
/// Aravis' own list keeps one camera per serial number, so it cannot tell that two have the same.
[[nodiscard]] std::vector<GigeAnswer> gige_cameras();

/// Throws Error(device) when no network card of this machine has the address.
void require_own_address(const std::string& address, const std::string& device);

/// UDP sockets of this process, by descriptor.
[[nodiscard]] std::vector<int> udp_sockets();

/// From now on the kernel drops every datagram to `socket` that does not come from `ip_address`,
/// and from `port` unless that is 0. So junk from elsewhere never reaches the camera library, whose
/// packet parser is not made for it. Returns false when the kernel refuses the filter.
[[nodiscard]] bool accept_only(int socket, const std::string& ip_address, std::uint16_t port);

/// Receive buffer that holds one frame of `payload_bytes` while nobody reads, as the kernel counts
/// it: every packet takes its bytes rounded up to a power of two, and its description.
[[nodiscard]] std::size_t receive_buffer_for(std::size_t payload_bytes,
                                             std::size_t packet_size_bytes);

/// Sets the receive buffer, beyond the kernel's limit where this process may, and returns what the
/// kernel says it is now, in the kernel's count.
std::size_t set_receive_buffer(int socket, std::size_t bytes);

/// Receive buffer that set_receive_buffer() would reach on a new socket.
[[nodiscard]] std::size_t reachable_receive_buffer(std::size_t bytes);

/// Needs CAP_NET_RAW.
[[nodiscard]] bool may_open_packet_socket();

/// Keys of the action command a camera obeys (GigE Vision 2.0).
struct ActionKeys {
  std::uint32_t device_key = 0x64726170;
  std::uint32_t group_key = 1;
  std::uint32_t group_mask = 1;
};

/// Sends action commands from one network card: all cameras that hold the keys expose when one
/// arrives, or at a time of their clock. Each camera gets its own datagram, back to back, so that
/// the time can be given in its own clock.
class ActionSender {
 public:
  explicit ActionSender(const std::string& host_address);
  /// False when the datagram could not be sent.
  [[nodiscard]] bool send(const std::string& camera_address,
                          std::optional<std::int64_t> device_ticks);

 private:
  Descriptor socket_;
  std::uint16_t request_id_ = 0;
};

}  // namespace drape::capture

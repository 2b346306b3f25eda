// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/host/camera_host.hpp"

// Sockets for GigE Vision that Aravis does not provide: discovery, filters and buffers for its
// streams, and action commands.
namespace drape::capture {

/// Port of GVCP, the control protocol (GigE Vision 2.0).
inline constexpr std::uint16_t kControlPort = 3956;

/// An IPv4 address of this machine.
struct NetworkCard {
  std::string name;  ///< interface name, without alias
  in_addr address, mask;
  bool up = false;
};
[[nodiscard]] std::vector<NetworkCard> network_cards();

/// Sends discovery commands on every network card and collects replies for one second: serial
/// numbers by address. Aravis' own list keeps one camera per serial number and so hides duplicates.
[[nodiscard]] std::map<std::string, std::string> gige_cameras();

/// Throws Error(device) if no network card of this machine has the address.
void require_own_address(const std::string& address, const std::string& device);

/// Descriptors of this process's UDP sockets.
[[nodiscard]] std::vector<int> udp_sockets();

/// Makes the kernel drop every datagram to `socket` that does not come from `ip_address` and,
/// unless 0, from `port`. Foreign packets then never reach the camera library; its parser is not
/// robust against them. Returns false if the kernel refuses the filter.
[[nodiscard]] bool accept_only(int socket, const std::string& ip_address, std::uint16_t port);

/// Receive buffer size for one unread frame of `payload_bytes`, in the kernel's accounting: each
/// packet takes its size rounded up to a power of two, plus its descriptor.
[[nodiscard]] std::size_t receive_buffer_for(std::size_t payload_bytes,
                                             std::size_t packet_size_bytes);

/// Sets the receive buffer, beyond the kernel's limit if this process is allowed to, and returns
/// the size that the kernel reports, in its own accounting.
std::size_t set_receive_buffer(int socket, std::size_t bytes);

/// Size that set_receive_buffer() would reach on a new socket.
[[nodiscard]] std::size_t reachable_receive_buffer(std::size_t bytes);

/// True if this process has CAP_NET_RAW.
[[nodiscard]] bool may_open_packet_socket();

/// Keys of the action commands that a camera obeys (GigE Vision 2.0).
struct ActionKeys {
  std::uint32_t device_key = 0x64726170;
  std::uint32_t group_key = 1;
  std::uint32_t group_mask = 1;
};

/// Sends action commands from one network card. All cameras that hold the keys expose when the
/// command arrives, or at a scheduled time of their clock. Each camera receives its own datagram,
/// back to back, so that the time can be given in its own clock.
class ActionSender {
 public:
  explicit ActionSender(const std::string& host_address);
  /// Returns false if the datagram could not be sent.
  [[nodiscard]] bool send(const std::string& camera_address,
                          std::optional<std::int64_t> device_ticks);

 private:
  Descriptor socket_;
  std::uint16_t request_id_ = 0;
};

}  // namespace drape::capture

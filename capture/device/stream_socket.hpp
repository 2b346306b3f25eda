// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace drape::capture {

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

/// What set_receive_buffer() would reach on a new socket.
[[nodiscard]] std::size_t reachable_receive_buffer(std::size_t bytes);

/// Needs CAP_NET_RAW.
[[nodiscard]] bool may_open_packet_socket();

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace drape::capture

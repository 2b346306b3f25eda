// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace drape::capture {

/// Of GVCP (GigE Vision 2.0).
inline constexpr std::uint16_t kControlPort = 3956;

/// What a GigE Vision camera says of itself when asked who is there.
struct GigeAnswer {
  std::string address, serial;
};

/// Asks on every network card and gathers the answers of one second, in order of their addresses.
/// Aravis' own list keeps one camera per serial number, so it cannot tell that two have the same.
[[nodiscard]] std::vector<GigeAnswer> gige_cameras();

/// Throws Error(device) that names their addresses when several cameras answer with this serial.
void refuse_duplicate_serial(const std::string& device);

/// Throws Error(device) when no network card of this machine has the address.
void require_own_address(const std::string& address, const std::string& device);

}  // namespace drape::capture

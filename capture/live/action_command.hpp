// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"

namespace drape::capture {

/// The GigE Vision action command as one datagram (GigE Vision 2.0, ACTION_CMD): all cameras that
/// hold the keys expose when it arrives, or at `device_ticks` of their clock when given. Aravis has
/// no call for it.
[[nodiscard]] std::vector<std::uint8_t> action_datagram(const ActionKeys& keys,
                                                        std::uint16_t request_id,
                                                        std::optional<std::int64_t> device_ticks);

/// Sends action commands from one network card. Cameras each get their own datagram, back to back,
/// so that a scheduled time can be given in each camera's own clock.
class ActionSender {
 public:
  explicit ActionSender(const std::string& host_address);
  ~ActionSender();
  ActionSender(const ActionSender&) = delete;
  ActionSender& operator=(const ActionSender&) = delete;
  /// False when the datagram could not be sent.
  [[nodiscard]] bool send(const std::string& camera_address,
                          std::optional<std::int64_t> device_ticks);

 private:
  int socket_ = -1;
  std::uint16_t request_id_ = 0;
};

}  // namespace drape::capture

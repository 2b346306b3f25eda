// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "capture/live/cameras_file.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/live/still.hpp"

namespace drape::capture {

/// One thing the doctor looked at.
struct Check {
  std::string name;
  bool go = true;
  std::string found;    ///< with units
  std::string to_type;  ///< what to do when it is NO-GO
};

struct LinkNeeds {
  double bytes_per_s = 0;   ///< image data and packet headers of one camera
  int packet_delay_ns = 0;  ///< that lets `cameras` share one link without colliding
};

/// Budget of cameras that share one link. A packet of `packet_size_bytes` goes with 18 bytes of
/// Ethernet frame around it and 20 of gap and preamble; the delay lets every other camera send a
/// packet in between.
[[nodiscard]] LinkNeeds link_needs(int width_px, int height_px, double frame_rate_hz,
                                   int packet_size_bytes, int cameras, double link_bits_per_s);

/// The machine's side: no camera is touched.
[[nodiscard]] Check check_socket_buffer(std::int64_t largest_bytes, std::int64_t frame_bytes);
[[nodiscard]] Check check_disk_space(std::uintmax_t free_bytes, std::uintmax_t needed_bytes,
                                     const std::string& folder);
[[nodiscard]] Check check_disk_speed(const std::filesystem::path& folder,
                                     double needed_bytes_per_s);
[[nodiscard]] std::vector<Check> check_mtu(const CamerasFile& cameras);
[[nodiscard]] std::vector<Check> check_link(const CamerasFile& cameras);
/// Do all devices of the rig answer, each once?
[[nodiscard]] std::vector<Check> check_devices(const CamerasFile& cameras,
                                               const std::vector<FoundDevice>& found);
/// Age of the calibration in days.
[[nodiscard]] Check check_calibration(const std::optional<std::filesystem::path>& calibration,
                                      double largest_days);
/// One captured set: were all frames whole and together, clocks, exposure, focus?
[[nodiscard]] std::vector<Check> check_capture(const LiveResult& live, const CamerasFile& cameras);

/// A short burst: is the cloth still, and is every camera where it was at the reference set?
[[nodiscard]] std::vector<Check> check_still(const StillReport& still);

/// Limit of the kernel on a socket's receive buffer, in bytes; 0 when it cannot be read.
[[nodiscard]] std::int64_t largest_socket_buffer();

}  // namespace drape::capture

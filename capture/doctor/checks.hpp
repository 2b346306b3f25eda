// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"

namespace drape::capture {

/// Result of one check by the doctor.
struct Check {
  std::string name;
  bool go = true;
  std::string found;         ///< finding, with units
  std::string to_type = {};  ///< remedy if NO-GO
};
void fields(Fields& f, Check& check);

/// Facts for the doctor's checks.
struct Evidence {
  CamerasFile cameras = {};
  std::filesystem::path out = ".";  ///< folder of the recordings
  std::optional<std::filesystem::path> calibration = {};
  double largest_days = 30;  ///< largest age of a calibration, days
  std::string today = {};    ///< today as ISO date
  std::vector<FoundDevice> found = {};
  std::size_t wanted = 3;           ///< number of sets in a short test burst
  LiveResult live = {};             ///< result of that burst
  StillReport still = {};           ///< motion in that burst
  std::optional<Error> fault = {};  ///< why there is no burst
  std::filesystem::path sys = "/sys";
};

/// Gathers the facts about a bench: discovers devices and captures a short burst.
[[nodiscard]] Evidence look_at_bench(const std::filesystem::path& rig,
                                     const std::filesystem::path& out,
                                     const std::optional<std::filesystem::path>& calibration);

/// Runs every check below, in this order.
[[nodiscard]] std::vector<Check> check_all(const Evidence& evidence);

// Checks; empty if a check does not apply.
using Checks = std::vector<Check>;
[[nodiscard]] Checks check_disk(const Evidence& evidence);  ///< free space, and speed for a set
/// Checks the verdict of the calibration, that its cameras are the rig's, and its age in days by
/// the run record beside it; without a record, warns. Empty without a calibration, which a capture
/// does not need.
[[nodiscard]] Checks check_calibration(const Evidence& evidence);
/// Checks acceptance.json beside rig.toml, if any. A NO-GO for this calibration is NO-GO; one that
/// has expired or is of another calibration is a warning.
[[nodiscard]] Checks check_acceptance(const Evidence& evidence);
/// Checks that all devices of the rig answer, each once.
[[nodiscard]] Checks check_devices(const Evidence& evidence);
/// Checks packet size and bandwidth for each network card of the GigE Vision cameras; cards are
/// taken from a capture's settings, else from cameras.toml and the subnets of the replies.
[[nodiscard]] Checks check_network(const Evidence& evidence);
/// Checks that the cameras on each USB bus fit its bandwidth. A camera's bus is found from its
/// device file below `sys`. Periodic transfers may use 80 % of a 480 Mbit/s bus (USB 2.0
/// specification, 5.6.4), and 90 % of a faster one with 8b/10b coding. JPEG is excluded, since its
/// size varies.
[[nodiscard]] Checks check_usb(const Evidence& evidence);
/// Checks that no frame is lost while the host is busy, from the report of each camera's host.
[[nodiscard]] Checks check_receive_buffers(const Evidence& evidence);
/// Checks the burst: complete frames in complete sets, clocks, exposure, focus.
[[nodiscard]] Checks check_capture(const Evidence& evidence);
/// Checks that the cloth is still and that no camera has moved since the reference set.
[[nodiscard]] Checks check_still(const Evidence& evidence);

struct LinkNeeds {
  double bytes_per_s = 0;   ///< image data and packet headers per camera
  int packet_delay_ns = 0;  ///< delay with which `cameras` share one link without collisions
};

/// Bandwidth of cameras that share a link. A packet of `packet_size_bytes` is carried with 18 bytes
/// of Ethernet framing and 20 of gap and preamble; the delay lets every other camera send a packet
/// in between.
[[nodiscard]] LinkNeeds link_needs(double frame_bytes, double frame_rate_hz, int packet_size_bytes,
                                   int cameras, double link_bits_per_s);

/// Lists devices through a separate camera host, so that a crashing library does no harm here.
/// Takes about 1 s. Throws Error(device) if the host fails.
[[nodiscard]] std::vector<FoundDevice> list_devices(const std::filesystem::path& host_program,
                                                    bool sizes = false);

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "capture/live/cameras_file.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/recording/still.hpp"

namespace drape::capture {

/// One thing the doctor looked at.
struct Check {
  std::string name;
  bool go = true;
  std::string found;         ///< with units
  std::string to_type = {};  ///< remedy when it is NO-GO
};
void fields(Fields& f, Check& check);

/// Evidence of the doctor's checks.
struct Evidence {
  CamerasFile cameras = {};
  std::filesystem::path out = ".";  ///< folder of the recordings
  std::optional<std::filesystem::path> calibration = {};
  double largest_days = 30;  ///< age of the calibration
  std::string today = {};    ///< ISO date
  std::vector<FoundDevice> found = {};
  std::size_t wanted = 3;           ///< sets of a short burst
  LiveResult live = {};             ///< result of that burst
  StillReport still = {};           ///< and what it shows
  std::optional<Error> fault = {};  ///< why there is none
  std::filesystem::path sys = "/sys";
};

/// Gathers the evidence of a bench: asks who answers, and captures a short burst.
[[nodiscard]] Evidence look_at_bench(const std::filesystem::path& rig,
                                     const std::filesystem::path& out,
                                     const std::optional<std::filesystem::path>& calibration);

/// Every check below, in this order.
[[nodiscard]] std::vector<Check> check_all(const Evidence& evidence);

// Each gives nothing where there is nothing to look at.
using Checks = std::vector<Check>;
[[nodiscard]] Checks check_disk(const Evidence& evidence);  ///< its space, and its speed for a set
/// Verdict of the calibration, whether it is of the rig's cameras, and its age in days by the
/// record beside it; without that a warning. Before the first one there is none to look at, and
/// nothing against a capture.
[[nodiscard]] Checks check_calibration(const Evidence& evidence);
/// acceptance.json beside rig.toml, if there is one: NO-GO where it is for this calibration; of
/// another calibration or expired today it is a warning.
[[nodiscard]] Checks check_acceptance(const Evidence& evidence);
/// Do all devices of the rig answer, each once?
[[nodiscard]] Checks check_devices(const Evidence& evidence);
/// Cards of all GigE Vision cameras, from what a capture read back, else from cameras.toml and the
/// addresses that answered, by their subnets: packet size and budget of each.
[[nodiscard]] Checks check_network(const Evidence& evidence);
/// Do the cameras of each USB bus fit it together? A bus is found by the device file of its camera
/// below `sys`. Periodic transfers may take 80 % of a bus of 480 Mbit/s (USB 2.0 specification,
/// 5.6.4), and 90 % of a faster one, which spends ten bits on eight. JPEG is left out: its size
/// varies.
[[nodiscard]] Checks check_usb(const Evidence& evidence);
/// Would a frame be lost while nobody reads, as each camera's host found?
[[nodiscard]] Checks check_receive_buffers(const Evidence& evidence);
/// Were all frames of the burst whole and together, clocks, exposure, focus?
[[nodiscard]] Checks check_capture(const Evidence& evidence);
/// Is the cloth still, and is every camera where it was at the reference set?
[[nodiscard]] Checks check_still(const Evidence& evidence);

struct LinkNeeds {
  double bytes_per_s = 0;   ///< image data and packet headers of one camera
  int packet_delay_ns = 0;  ///< delay that lets `cameras` use one link without colliding
};

/// Budget of cameras on one link. A packet of `packet_size_bytes` goes with 18 bytes of
/// Ethernet frame around it and 20 of gap and preamble; the delay lets every other camera send a
/// packet in between.
[[nodiscard]] LinkNeeds link_needs(double frame_bytes, double frame_rate_hz, int packet_size_bytes,
                                   int cameras, double link_bits_per_s);

}  // namespace drape::capture

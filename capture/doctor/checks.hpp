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
#include "capture/recording/still.hpp"

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
  int packet_delay_ns = 0;  ///< that lets `cameras` use one link without colliding
};

/// Budget of cameras on one link. A packet of `packet_size_bytes` goes with 18 bytes of
/// Ethernet frame around it and 20 of gap and preamble; the delay lets every other camera send a
/// packet in between.
[[nodiscard]] LinkNeeds link_needs(double frame_bytes, double frame_rate_hz, int packet_size_bytes,
                                   int cameras, double link_bits_per_s);

/// The machine's side: no camera is touched.
[[nodiscard]] Check check_disk_space(std::uintmax_t free_bytes, std::uintmax_t needed_bytes,
                                     const std::string& folder);
/// `needed_bytes` is a set's.
[[nodiscard]] Check check_disk_speed(const std::filesystem::path& folder,
                                     double needed_bytes_per_s);
/// A camera of the network and the card it is reached by.
struct Reached {
  std::string camera, card;
  int packet_size_bytes = 0;
  double frame_bytes = 0;
};
/// Cards of all GigE Vision cameras: from what a capture read back, else from cameras.toml and the
/// addresses that answered, by their subnets.
[[nodiscard]] std::vector<Reached> reached_cameras(const CamerasFile& cameras,
                                                   const std::vector<FoundDevice>& found,
                                                   const LiveReport& report);
[[nodiscard]] std::vector<Check> check_mtu(const std::vector<Reached>& cameras);
[[nodiscard]] std::vector<Check> check_link(const std::vector<Reached>& cameras,
                                            double frame_rate_hz);
/// Do the cameras of each USB bus fit it together? A bus is found by the device file of its camera
/// below `sys`. Periodic transfers may take 80 % of a bus of 480 Mbit/s (USB 2.0 specification,
/// 5.6.4), and 90 % of a faster one, which spends ten bits on eight. JPEG is left out: its size
/// varies.
[[nodiscard]] std::vector<Check> check_usb(const CamerasFile& cameras,
                                           const std::vector<FoundDevice>& found,
                                           const LiveReport& report,
                                           const std::filesystem::path& sys = "/sys");
/// Would a frame be lost while nobody reads, as each camera's host found?
[[nodiscard]] std::vector<Check> check_receive_buffers(const LiveReport& report);
/// Do all devices of the rig answer, each once?
[[nodiscard]] std::vector<Check> check_devices(const CamerasFile& cameras,
                                               const std::vector<FoundDevice>& found);
/// Verdict of the calibration, whether it is of the rig's cameras, and its age in days by the
/// record beside it; without that a warning. Before the first one there is none to look at, and
/// nothing against a capture.
[[nodiscard]] Check check_calibration(const std::optional<std::filesystem::path>& calibration,
                                      const CamerasFile& rig, double largest_days);
/// acceptance.json beside rig.toml, if there is one: NO-GO where it is for this calibration; of
/// another calibration or expired on `today` (ISO date) it is a warning.
[[nodiscard]] Check check_acceptance(const std::filesystem::path& rig,
                                     const std::optional<std::filesystem::path>& calibration,
                                     const std::string& today);
/// Both of these, today.
[[nodiscard]] std::vector<Check> check_calibrated(
    const std::filesystem::path& rig, const CamerasFile& cameras,
    const std::optional<std::filesystem::path>& calibration, double largest_days);
/// `wanted` sets: were all frames whole and together, clocks, exposure, focus?
[[nodiscard]] std::vector<Check> check_capture(const LiveResult& live, const CamerasFile& cameras,
                                               std::size_t wanted);

/// A short burst: is the cloth still, and is every camera where it was at the reference set?
[[nodiscard]] std::vector<Check> check_still(const StillReport& still);

}  // namespace drape::capture

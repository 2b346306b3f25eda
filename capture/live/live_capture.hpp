// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "capture/host/camera_host.hpp"
#include "capture/live/cameras_file.hpp"
#include "capture/pairing/pairing.hpp"

namespace drape::capture {

struct LiveOptions {
  int frames = 1;  ///< sets wanted
  std::filesystem::path host_program;
  int memory_limit_mb = 2048;  ///< per camera host
  double patience_s = 20;      ///< without a new frame of every camera, it ends with what it has
  double opening_s = 15;       ///< in which every camera must be open at the start
  bool keep_pixels = true;     ///< false only counts, for long tests
  std::function<void(double, const std::string&)> progress = {};

  void check() const;
};

/// A frame of a set, pixels as the sensor gave them (8 bit grey, row by row).
struct LiveFrame {
  FrameMark mark;
  int width_px = 0, height_px = 0;
  std::string fault;
  std::vector<std::uint8_t> pixels;
};

/// Something that went wrong and was seen: which camera, what, and what to do.
struct LiveFault {
  std::string camera, what, what_to_do;
};

struct LiveCameraReport {
  std::string name;
  CameraIdentity identity;
  std::vector<SettingReadBack> settings;
  std::optional<ClockFit> clock;  ///< absent when the device counts on the host's clock
  CameraLedger ledger;
  CameraCounters counters;
  std::int64_t frames_without_room = 0;
  int host_launches = 0;
  double longest_gap_s = 0;        ///< longest time between a fault and the first frame after it
  double longest_unnoticed_s = 0;  ///< longest time between a last frame and the fault noticed
};

struct LiveReport {
  SyncMethod method = SyncMethod::free_run;  ///< that was used
  std::string why_fallen_back;               ///< empty when it is the one asked for
  std::int64_t triggers = 0;
  std::vector<LiveCameraReport> cameras;
  std::vector<LiveFault> faults;
};

struct LiveResult {
  std::vector<LiveFrame> frames;
  PairingResult pairing;  ///< indices into `frames`; at most LiveOptions::frames sets
  LiveReport report;
};

/// Captures sets of all cameras, each camera in its own process. A camera that fails is started
/// again and again while the others go on. Throws Error(device) when a camera cannot be opened at
/// the start; whatever happens later is in the report, and no frame is in a set that is not whole.
[[nodiscard]] LiveResult capture_live(const CamerasFile& cameras, const LiveOptions& options);

}  // namespace drape::capture

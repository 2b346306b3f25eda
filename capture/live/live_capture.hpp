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
  int frames = 1;  ///< number of sets
  std::filesystem::path host_program;
  int memory_limit_mb = 2048;  ///< per camera host
  double patience_s = 20;      ///< limit of a camera's silence, which ends the capture
  double opening_s = 15;       ///< time limit for opening all cameras
  bool keep_pixels = true;     ///< false: only counts frames, for long tests
  /// Receives each set with the report so far. Its pixels are then not kept in the result, so that
  /// memory does not grow with the number of sets.
  std::function<void(struct LiveSet, const struct LiveReport&)> on_set = {};
  /// Polled in a session led by an operator. A set is taken only on `take` and passed to on_set,
  /// after which the answer must change.
  enum class Demand { wait, take, end };
  std::function<Demand()> demand = {};
  /// Polled; true ends the capture with the sets so far.
  std::function<bool()> ended = {};
  std::function<void(double, const std::string&)> progress = {};
  /// Receives the newest complete frame of a camera for display. If set, cameras that
  /// wait for a trigger are also triggered between sets; those frames belong to no
  /// set.
  std::function<void(std::size_t camera, const HostFrame& frame, const CameraHost& host)> on_frame =
      {};
  /// Returns an exposure or gain requested by the operator; polled while no set is wanted. on_light
  /// receives the result.
  struct Light {
    std::size_t camera = 0;
    CameraSettings wanted;
  };
  std::function<std::optional<Light>()> light = {};
  std::function<void(std::size_t camera, const CameraHost& host,
                     const CameraHost::LightAnswer& answer)>
      on_light = {};
  /// Called immediately when a camera is lost and when it is back.
  std::function<void(const struct LiveFault&)> on_camera = {};
};

/// A frame that belongs to a set.
struct LiveFrame {
  FrameMark mark;
  int width_px = 0, height_px = 0;
  std::string fault;
  std::vector<std::uint8_t> pixels;  ///< grey 0..255, row by row
  /// Grey values of more than 8 bits: the sensor's full depth in the high bits of 16.
  std::vector<std::uint16_t> deep = {};
  int bits = 8;  ///< bits per sensor sample
  std::string pixel_format = {};
  std::vector<std::uint8_t> raw = {};  ///< bytes as sent, unless the grey values hold them all
};

/// One frame of every camera, exposed at the same instant.
struct LiveSet {
  std::optional<double> spread_s;        ///< absent if unknown
  std::optional<double> spread_bound_s;  ///< upper bound if the spread itself is unknown
  std::optional<std::int64_t> trigger;
  std::vector<LiveFrame> frames;
};

/// An observed fault: which camera, what happened, what to do, and how often.
struct LiveFault {
  std::string camera, what, what_to_do;
  int times = 1;
};

/// Adds the fault to the list, or increments the count of an equal one.
void add_fault(std::vector<LiveFault>& faults, LiveFault fault);

/// Property that assigns frames to a set.
enum class PairedBy { trigger, time, arrival };

struct LiveCameraReport {
  std::string name;
  CameraIdentity identity;
  std::vector<SettingReadBack> settings;
  std::optional<ClockFit> clock;  ///< absent if the device uses the host's clock
  CameraLedger ledger;
  CameraCounters counters;
  std::int64_t frames_without_room = 0;
  int host_launches = 0;
  double longest_gap_s = 0;        ///< longest time from a fault to the next frame
  double longest_unnoticed_s = 0;  ///< longest time from the last frame to detection of the fault
};

struct LiveReport {
  SyncMethod method = SyncMethod::free_run;  ///< method that was finally used
  std::string why_fallen_back;  ///< reason for not using the requested method; empty if used
  PairedBy paired_by = PairedBy::time;
  std::int64_t triggers = 0;
  std::int64_t triggers_before =
      0;  ///< triggers before the capture or for display, outside all sets
  std::vector<LiveCameraReport> cameras;
  std::vector<LiveFault> faults;
};

struct LiveResult {
  std::vector<LiveFrame> frames;
  PairingResult pairing;  ///< indices into `frames`; at most LiveOptions::frames sets
  LiveReport report;
};

/// Captures sets from all cameras, each in its own process. A camera that fails is restarted
/// repeatedly while the others continue. Throws Error(device) if a camera cannot be opened at the
/// start; later faults are in the report, and no set contains an incomplete frame.
[[nodiscard]] LiveResult capture_live(const CamerasFile& cameras, const LiveOptions& options);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::PairedBy>[] = {
    "trigger", "device time", "arrival"};

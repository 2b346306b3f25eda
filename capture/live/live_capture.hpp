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
  /// Takes each set, with the report up to then; its pixels are then not in the result. So memory
  /// does not grow with the number of sets.
  std::function<void(struct LiveSet, const struct LiveReport&)> on_set = {};
  /// A session that an operator leads: asked all the time; a set is taken only on `take`, and then
  /// handed to on_set, which is what changes the answer.
  enum class Demand { wait, take, end };
  std::function<Demand()> demand = {};
  /// Looked at all the time: true ends the capture with what it has.
  std::function<bool()> ended = {};
  std::function<void(double, const std::string&)> progress = {};
  /// Takes whole frames for a screen: the newest of a camera whenever nothing newer of it waits.
  /// With it, a session whose cameras wait for a trigger triggers them between sets, too; those
  /// frames are in no set.
  std::function<void(std::size_t camera, const HostFrame& frame, const CameraHost& host)> on_frame =
      {};
  /// Exposure and gain that the operator of a session wants of a camera: asked for while no set is
  /// wanted; on_light hears what came of it.
  struct Light {
    std::size_t camera = 0;
    CameraSettings wanted;
  };
  std::function<std::optional<Light>()> light = {};
  std::function<void(std::size_t camera, const CameraHost& host,
                     const CameraHost::LightAnswer& answer)>
      on_light = {};
  /// Called at once when a camera is lost, and when it is back.
  std::function<void(const struct LiveFault&)> on_camera = {};

  void check() const;
};

/// A frame of a set.
struct LiveFrame {
  FrameMark mark;
  int width_px = 0, height_px = 0;
  std::string fault;
  std::vector<std::uint8_t> pixels;  ///< grey 0..255, row by row
  /// Grey of more than 8 bits, with the sensor's full depth in the high bits of 16.
  std::vector<std::uint16_t> deep = {};
  int bits = 8;  ///< bits in a sample of the sensor
  std::string pixel_format = {};
  std::vector<std::uint8_t> raw = {};  ///< bytes as sent, where the grey does not hold all of them
};

/// One frame of every camera, of one instant.
struct LiveSet {
  std::optional<double> spread_s;        ///< absent when it is not known
  std::optional<double> spread_bound_s;  ///< then: all exposures lie within that time
  std::optional<std::int64_t> trigger;
  std::vector<LiveFrame> frames;
};

/// Something that went wrong and was seen: which camera, what, what to do, and how often.
struct LiveFault {
  std::string camera, what, what_to_do;
  int times = 1;
};

/// Adds to the list, or counts one more of the same.
void add_fault(std::vector<LiveFault>& faults, LiveFault fault);

/// Property that the frames of a set share.
enum class PairedBy { trigger, time, arrival };

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
  SyncMethod method = SyncMethod::free_run;  ///< method that was used
  std::string why_fallen_back;               ///< empty when it is the one asked for
  PairedBy paired_by = PairedBy::time;
  std::int64_t triggers = 0;
  std::int64_t triggers_before =
      0;  ///< whose frames showed that the cameras answer, or what they see
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

template <>
inline constexpr std::string_view drape::names_of<drape::capture::PairedBy>[] = {
    "trigger", "device time", "arrival"};

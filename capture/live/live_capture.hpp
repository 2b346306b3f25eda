// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "capture/host/camera_host.hpp"
#include "capture/pairing/pairing.hpp"
#include "core/fields/records.hpp"

namespace drape::capture {

/// Methods to make cameras expose together, in ascending order of quality.
enum class SyncMethod { free_run, software_trigger, line_trigger, action, scheduled_action };

[[nodiscard]] TriggerSource trigger_of(SyncMethod method);

struct LiveCamera {
  std::string name;  ///< camera name in rig.toml
  CameraAddress address;
  CameraSettings settings;
};

/// Frames of the bench without cloth, recorded with the calibration.
struct ReferenceSet {
  std::filesystem::path recording;
  std::string set;
};

/// cameras.toml beside rig.toml: device and settings of each camera of the rig, and how all of them
/// are synchronised.
struct CamerasFile {
  Document document = {};
  std::filesystem::path file = {}, rig_file = {};
  std::vector<LiveCamera> cameras = {};  ///< in the order of rig.toml
  SyncMethod method = SyncMethod::free_run;
  std::vector<SyncMethod> fall_backs =
      {};            ///< tried in this order if a camera does not support `method`
  bool ptp = false;  ///< enable PTP in cameras that support it
  /// Pair frames by time of arrival if the cameras' clocks cannot be read; the spread of such a set
  /// is unknown.
  bool pair_by_arrival = false;
  double frame_rate_hz = 10;                   ///< rate of free run and of triggers
  double largest_spread_s = 0;                 ///< sets with a larger spread are refused
  std::optional<ReferenceSet> reference = {};  ///< shows whether a camera has moved
};

void fields(Fields& f, LiveCamera& camera);
void fields(Fields& f, ReferenceSet& reference);
void fields(Fields& f, CamerasFile& file);

/// Reads cameras.toml beside the rig (given by folder or file), which defines names and sizes.
/// Throws Error(bad_input) for a camera that is missing, named twice, or shares a device.
[[nodiscard]] CamerasFile read_cameras_file(const std::filesystem::path& rig_path);

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

/// Converts a camera's frame to grey and depth, keeping the raw bytes if needed. A frame whose size
/// does not match its pixel format gets a fault and no pixels.
[[nodiscard]] LiveFrame develop(HostFrame frame, const std::string& pixel_format);

/// Quality of an 8-bit grey frame, independent of its content.
struct FrameQuality {
  double mean = 0;                ///< mean grey level, 0..255
  double dark_fraction = 0;       ///< pixels at level 3 or below
  double saturated_fraction = 0;  ///< pixels at level 254 or above, where some sensors saturate
  double contrast = 0;            ///< 99th minus 1st percentile of the grey level
  /// Slope of the steepest edges: the 99.9th percentile of the difference between neighbouring
  /// pixels, divided by `contrast`. A sharp edge reaches about 0.3 or more, in any light.
  double sharpness = 0;
};

struct QualityLimits {
  double least_contrast = 30;
  double largest_saturated_fraction = 0.05;
  double least_sharpness = 0.10;
};

[[nodiscard]] FrameQuality quality_of(std::span<const std::uint8_t> pixels, int width_px);

/// Explains why such a frame cannot be measured; nullopt if it can.
[[nodiscard]] std::optional<std::string> quality_fault(const FrameQuality& quality,
                                                       const QualityLimits& limits);

/// Remedy for the operator.
[[nodiscard]] std::string quality_remedy(const FrameQuality& quality, const QualityLimits& limits);

/// Preview pictures of open cameras: <folder>/<camera>.pgm, replaced atomically by each new
/// picture. A pixel is the mean of a square of the sensor's pixels, at most 254; 255 means that at
/// least one of them is saturated. The file's comment is JSON:
///
///   arrived_ns         when the frame was whole in this machine, ns since 1970 (UTC)
///   saturated_percent  of the sensor's pixels that are saturated
///   dot_sigma_px       see dot_sigma_px(); null where the picture has no contrast
///   settings           settings reported by the camera, by name
///   asked              exposure_us and gain_db last requested; null if none was
class PreviewWriter {
 public:
  PreviewWriter(const CamerasFile& cameras, std::filesystem::path folder);

  /// Writes a picture. Throws Error(bad_input) if the file cannot be written.
  void show(std::size_t camera, const LiveFrame& frame,
            const std::vector<SettingReadBack>& settings, const CameraSettings& asked);

 private:
  const CamerasFile& cameras_;
  std::filesystem::path folder_;
  struct Focus {
    std::int64_t looked_ns = 0;
    std::optional<double> dot_sigma_px;
  };
  std::vector<Focus> focus_;  ///< per camera, updated once per second
};

/// Cramer-Rao bound on the standard deviation, along one axis, of the centre of a dark dot of 10 px
/// radius that is as sharp as the sharpest edges of the frame and as noisy as its plain areas:
/// noise * sqrt(2 blur / (sqrt(pi) radius)) / contrast, for a step blurred by a Gaussian of
/// standard deviation `blur` (the squared slope integrates to contrast^2 / (2 sqrt(pi) blur) per px
/// of rim, half of which constrains one axis). The blur follows from the steepest slopes, contrast
/// / (sqrt(2 pi) blur); the noise from second differences of three neighbours, which amplify it by
/// sqrt(6). nullopt if the contrast is too low for a usable frame.
[[nodiscard]] std::optional<double> dot_sigma_px(const LiveFrame& frame);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::SyncMethod>[] = {
    "free_run", "software_trigger", "line_trigger", "action", "scheduled_action"};

template <>
inline constexpr drape::Format drape::format_of<drape::capture::CamerasFile>{
    "cameras", Syntax::toml, 1, "devices and settings of the cameras of a rig"};

template <>
inline constexpr std::string_view drape::names_of<drape::capture::PairedBy>[] = {
    "trigger", "device time", "arrival"};

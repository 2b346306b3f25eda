// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "core/fields/records.hpp"

namespace drape::capture {

/// Methods to make cameras expose together, in ascending order of quality.
enum class SyncMethod { free_run, software_trigger, line_trigger, action, scheduled_action };

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::SyncMethod>[] = {
    "free_run", "software_trigger", "line_trigger", "action", "scheduled_action"};

namespace drape::capture {

[[nodiscard]] inline std::string to_string(SyncMethod method) {
  return std::string(name_of(method));
}
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

}  // namespace drape::capture

template <>
inline constexpr drape::Format drape::format_of<drape::capture::CamerasFile>{
    "cameras", Syntax::toml, 1, "devices and settings of the cameras of a rig"};

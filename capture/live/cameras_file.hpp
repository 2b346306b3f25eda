// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/device/camera.hpp"
#include "core/fields/records.hpp"

namespace drape::capture {

/// Ways to make cameras expose together, best last.
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
  std::string name;  ///< name in rig.toml
  CameraAddress address;
  CameraSettings settings;
};

/// Frames of the bench without a cloth, recorded with the calibration.
struct ReferenceSet {
  std::filesystem::path recording;
  std::string set;
};

/// cameras.toml beside rig.toml: which device each camera of the rig is, how it is set, and how all
/// are synchronised.
struct CamerasFile {
  Document document = {};
  std::filesystem::path file = {}, rig_file = {};
  std::vector<LiveCamera> cameras = {};  ///< in the order of rig.toml
  SyncMethod method = SyncMethod::free_run;
  std::vector<SyncMethod> fall_backs =
      {};            ///< tried in this order when a camera cannot do `method`
  bool ptp = false;  ///< switch PTP on in cameras that have it
  /// Frames of cameras whose clocks cannot be read are paired by their arrival: the spread of such
  /// a set is not known.
  bool pair_by_arrival = false;
  double frame_rate_hz = 10;                   ///< free run, and the pace of the triggers
  double largest_spread_s = 0;                 ///< a set of larger spread is refused
  std::optional<ReferenceSet> reference = {};  ///< tells whether a camera has moved
};

void fields(Fields& f, LiveCamera& camera);
void fields(Fields& f, ReferenceSet& reference);
void fields(Fields& f, CamerasFile& file);

/// Reads cameras.toml beside the rig (its folder or file), which has the names and sizes. Throws
/// Error(bad_input) for a camera that is missing, named twice, or the same device as another.
[[nodiscard]] CamerasFile read_cameras_file(const std::filesystem::path& rig_path);

}  // namespace drape::capture

template <>
inline constexpr drape::Format drape::format_of<drape::capture::CamerasFile>{
    "cameras", Syntax::toml, 1, "which devices the cameras of a rig are, and how they are set"};

// SPDX-License-Identifier: Apache-2.0
#include "capture/live/live_capture.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "core/rig.hpp"

namespace drape::capture {
namespace {

/// Table [sync] of the file.
struct Sync {
  CamerasFile& of;
};

void fields(Fields& f, Sync& sync) {
  CamerasFile& of = sync.of;
  std::optional<double> spread_s;
  if (!f.reads()) spread_s = of.largest_spread_s;
  f({"method", "how the exposures are synchronised"}, of.method);
  f.if_any({"fall_back", "methods to try if a camera does not support it"}, of.fall_backs);
  f.otherwise({"ptp", "switch PTP on if available"}, of.ptp);
  f.otherwise({"pair_by_arrival", "pair by arrival time: for cameras without a clock in free run"},
              of.pair_by_arrival);
  f({"frame_rate_hz", "frame rate in free run, and rate of triggers", 1, above_zero},
    of.frame_rate_hz);
  f.if_any({"largest_spread_ms", "sets with a larger spread are refused", 1e-3, above_zero},
           spread_s);
  of.largest_spread_s = spread_s.value_or(0.4 / of.frame_rate_hz);
}

/// Throws for two cameras of the same name or device, and for exposures too long for the
/// free-running frame rate.
void require_consistent(const CamerasFile& file) {
  std::map<std::string, std::string> name_of_device;
  std::set<std::string> names;
  for (std::size_t c = 0; c < file.cameras.size(); ++c) {
    const LiveCamera& camera = file.cameras[c];
    const auto reject = [&](const char* key, std::string what, std::string what_to_do) {
      throw bad_input(std::move(what), file.document.where(fmt::format("camera.{}.{}", c, key)),
                      std::move(what_to_do));
    };
    const auto [other, is_new] = name_of_device.try_emplace(
        fmt::format("{} {}", name_of(camera.address.backend), camera.address.device), camera.name);
    if (!is_new)
      reject("device",
             fmt::format("cameras `{}` and `{}` are the same device", other->second, camera.name),
             "name another serial number or address");
    if (!names.insert(camera.name).second)
      reject("name", fmt::format("camera `{}` is there twice", camera.name), "remove one");
    if (file.method == SyncMethod::free_run &&
        1e-6 * camera.settings.exposure_us.value_or(0) > 1 / file.frame_rate_hz)
      reject("exposure_us",
             fmt::format("it is longer than the period of {:.1f} ms in which a free-running camera "
                         "exposes",
                         1e3 / file.frame_rate_hz),
             "lower exposure_us or frame_rate_hz");
  }
}

}  // namespace

void fields(Fields& f, ReferenceSet& reference) {
  f({"recording", "folder of the recording"}, reference.recording);
  f({"set", "set that shows the bench without cloth"}, reference.set);
}

void fields(Fields& f, LiveCamera& camera) {
  f({"name", "camera of rig.toml"}, camera.name);
  fields(f, camera.address);
  own_fields(f, camera.settings);
  const bool plays = !camera.address.recording.empty();
  f.rule(plays == (camera.address.backend == Backend::replay), "recording",
         plays ? "only the backend replay plays a recording" : "the value is missing",
         "give `recording` where the backend is replay, and there alone");
}

void fields(Fields& f, CamerasFile& file) {
  Sync sync{file};
  f({"sync", "how the cameras are synchronised"}, sync);
  f.if_any({"reference", "set of the bench without cloth, recorded with the calibration"},
           file.reference);
  f({"camera", "one table per camera of the rig"}, file.cameras);
}

TriggerSource trigger_of(SyncMethod method) {
  using enum TriggerSource;
  constexpr TriggerSource kSources[] = {free_run, software, line, action, action};  // by method
  return kSources[static_cast<std::size_t>(method)];
}

CamerasFile read_cameras_file(const std::filesystem::path& rig_path) {
  const Rig rig = read_rig(rig_path);
  const std::filesystem::path file = rig.file.parent_path() / "cameras.toml";
  if (!std::filesystem::exists(file))
    throw bad_input(
        "the rig does not say which devices its cameras are", {.file = file.string()},
        "write cameras.toml as capture/README.md shows; `drape capture cameras` lists the devices");
  auto result = read_record<CamerasFile>(file);
  result.file = file;
  result.rig_file = rig.file;
  require_consistent(result);
  std::vector<LiveCamera> named = std::exchange(result.cameras, {});
  for (const LiveCamera& camera : named) static_cast<void>(rig.camera(camera.name));
  for (const RigCamera& camera : rig.cameras) {
    const auto found = std::ranges::find(named, camera.name, &LiveCamera::name);
    if (found == named.end())
      throw bad_input("a camera of the rig has no device",
                      {.file = file.string(), .camera = camera.name},
                      "add a [[camera]] table of that name");
    CameraSettings& settings = found->settings;
    settings.width_px = camera.width_px;
    settings.height_px = camera.height_px;
    settings.frame_rate_hz = result.frame_rate_hz;
    settings.ptp = result.ptp;
    result.cameras.push_back(std::move(*found));
  }
  return result;
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#include "capture/live/cameras_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "capture/pixel/pixel_format.hpp"
#include "core/error.hpp"
#include "core/files/toml_file.hpp"
#include "core/rig.hpp"

namespace drape::capture {
namespace {

SyncMethod method_of(const TomlTable& table, const std::string& key, const std::string& name) {
  for (const SyncMethod m :
       {SyncMethod::free_run, SyncMethod::software_trigger, SyncMethod::line_trigger,
        SyncMethod::action, SyncMethod::scheduled_action}) {
    if (to_string(m) == name) return m;
  }
  table.reject(key, fmt::format("`{}` does not synchronise cameras", name),
               "use free_run, software_trigger, line_trigger, action or scheduled_action");
}

Backend backend_of(const TomlTable& table) {
  const std::string name = table.text("backend");
  for (const Backend b : {Backend::aravis, Backend::v4l2, Backend::replay}) {
    if (to_string(b) == name) return b;
  }
  table.reject("backend", fmt::format("`{}` is no backend", name), "use aravis, v4l2 or replay");
}

std::optional<double> positive_if_there(const TomlTable& table, const std::string& key) {
  if (!table.has(key)) return std::nullopt;
  return table.positive(key);
}

std::optional<int> integer_if_there(const TomlTable& table, const std::string& key) {
  if (!table.has(key)) return std::nullopt;
  const int value = table.integer(key);
  if (value < 0) table.reject(key, "the number is negative", "give 0 or more");
  return value;
}

LiveCamera read_camera(const TomlTable& table, const Rig& rig) {
  LiveCamera camera;
  camera.name = table.text("name");
  const RigCamera& in_rig = rig.camera(camera.name);
  camera.address.backend = backend_of(table);
  camera.address.device = table.text("device");
  camera.address.host_address = table.text_or("host_address", "");
  if (camera.address.backend == Backend::replay)
    camera.address.recording = table.file_path("recording").string();
  CameraSettings& s = camera.settings;
  s.width_px = in_rig.width_px;
  s.height_px = in_rig.height_px;
  s.offset_x_px = integer_if_there(table, "offset_x_px");
  s.offset_y_px = integer_if_there(table, "offset_y_px");
  s.pixel_format = table.text_or("pixel_format", "");
  s.exposure_us = positive_if_there(table, "exposure_us");
  if (table.has("gain_db")) s.gain_db = table.not_negative("gain_db");
  s.packet_size_bytes = integer_if_there(table, "packet_size_bytes");
  s.packet_delay_ns = integer_if_there(table, "packet_delay_ns");
  s.trigger_line = table.text_or("trigger_line", "Line1");
  if (!s.pixel_format.empty() && find_pixel_format(s.pixel_format) == nullptr)
    table.reject("pixel_format", fmt::format("{} frames cannot be recorded", s.pixel_format),
                 "leave it out, so that the camera's best is taken");
  return camera;
}

void read_sync(const TomlTable& root, CamerasFile& result) {
  const TomlTable sync = root.table("sync");
  result.method = method_of(sync, "method", sync.text("method"));
  if (sync.has("fall_back"))
    for (const std::string& name : sync.texts("fall_back"))
      result.fall_backs.push_back(method_of(sync, "fall_back", name));
  result.frame_rate_hz = sync.positive("frame_rate_hz");
  result.ptp = sync.boolean_or("ptp", false);
  result.pair_by_arrival = sync.boolean_or("pair_by_arrival", false);
  result.largest_spread_s = sync.has("largest_spread_ms")
                                ? 1e-3 * sync.positive("largest_spread_ms")
                                : 0.4 / result.frame_rate_hz;
}

void read_reference(const TomlTable& root, CamerasFile& result) {
  if (!root.has("reference")) return;
  const TomlTable table = root.table("reference");
  result.reference = ReferenceSet{table.file_path("recording"), table.text("set")};
}

}  // namespace

std::string to_string(SyncMethod method) {
  switch (method) {
    case SyncMethod::free_run:
      return "free_run";
    case SyncMethod::software_trigger:
      return "software_trigger";
    case SyncMethod::line_trigger:
      return "line_trigger";
    case SyncMethod::action:
      return "action";
    case SyncMethod::scheduled_action:
      return "scheduled_action";
  }
  return {};
}

TriggerSource trigger_of(SyncMethod method) {
  switch (method) {
    case SyncMethod::free_run:
      return TriggerSource::free_run;
    case SyncMethod::software_trigger:
      return TriggerSource::software;
    case SyncMethod::line_trigger:
      return TriggerSource::line;
    case SyncMethod::action:
    case SyncMethod::scheduled_action:
      return TriggerSource::action;
  }
  return TriggerSource::free_run;
}

CamerasFile read_cameras_file(const std::filesystem::path& rig_path) {
  const Rig rig = read_rig(rig_path);
  CamerasFile result;
  result.rig_file = rig.file;
  result.file = rig.file.parent_path() / "cameras.toml";
  if (!std::filesystem::exists(result.file))
    throw bad_input(
        "the rig does not say which devices its cameras are", {.file = result.file.string()},
        "write cameras.toml as capture/README.md shows; `drape capture cameras` lists the devices");
  const TomlTable root = TomlTable::open(result.file, "cameras");
  read_sync(root, result);
  read_reference(root, result);
  std::map<std::string, LiveCamera> by_name;
  std::map<std::string, std::string> name_of_device;
  for (const TomlTable& table : root.tables("camera")) {
    const LiveCamera camera = read_camera(table, rig);
    const std::string device = to_string(camera.address.backend) + " " + camera.address.device;
    const auto [other, is_new] = name_of_device.try_emplace(device, camera.name);
    if (!is_new)
      table.reject(
          "device",
          fmt::format("cameras `{}` and `{}` are the same device", other->second, camera.name),
          "name another serial number or address");
    if (!by_name.try_emplace(camera.name, camera).second)
      table.reject("name", fmt::format("camera `{}` is there twice", camera.name), "remove one");
    if (result.method == SyncMethod::free_run && camera.settings.exposure_us &&
        1e-6 * *camera.settings.exposure_us > 1 / result.frame_rate_hz)
      table.reject("exposure_us",
                   fmt::format("it is longer than the period of {:.1f} ms in which a "
                               "free-running camera exposes",
                               1e3 / result.frame_rate_hz),
                   "lower exposure_us or frame_rate_hz");
  }
  root.finish();
  for (const RigCamera& camera : rig.cameras) {
    const auto found = by_name.find(camera.name);
    if (found == by_name.end())
      throw bad_input("a camera of the rig has no device",
                      {.file = result.file.string(), .camera = camera.name},
                      "add a [[camera]] table of that name");
    found->second.settings.frame_rate_hz = result.frame_rate_hz;
    found->second.settings.ptp = result.ptp;
    result.cameras.push_back(found->second);
  }
  return result;
}

}  // namespace drape::capture

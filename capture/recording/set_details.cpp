// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/set_details.hpp"

#include "core/files/files.hpp"

namespace drape::capture {
namespace {

Json optional_json(const std::optional<double>& value, double scale = 1) {
  return value ? Json(*value * scale) : Json();
}

Json json_of(const CameraLedger& ledger) {
  return {{"expected", ledger.expected},           {"in_set", ledger.in_set},
          {"unpaired", ledger.unpaired},           {"incomplete", ledger.incomplete},
          {"never_arrived", ledger.never_arrived}, {"repeated_id", ledger.repeated}};
}

Json json_of(const std::optional<ClockFit>& clock) {
  if (!clock) return {};
  Json json;
  json["drift_ppm"] = clock->drift_estimated ? Json(clock->drift_ppm) : Json();
  json["residual_us"] = 1e6 * clock->residual_s;
  json["offset_bound_us"] = 1e6 * clock->offset_bound_s();
  json["samples"] = clock->samples;
  return json;
}

Json camera_json(const LiveCameraReport& camera, const LiveFrame& frame,
                 const FrameQuality& quality) {
  Json json;
  json["camera"] = camera.name;
  json["device"] = {{"vendor", camera.identity.vendor},
                    {"model", camera.identity.model},
                    {"serial", camera.identity.serial},
                    {"address", camera.identity.address},
                    {"host_address", camera.identity.host_address}};
  json["settings_read_back"] = Json::object();
  for (const SettingReadBack& s : camera.settings) json["settings_read_back"][s.name] = s.value;
  json["frame_index"] = frame.mark.index;
  json["time_s"] = optional_json(frame.mark.time_s);
  json["clock_fit"] = json_of(camera.clock);
  json["ledger_frames"] = json_of(camera.ledger);
  json["packets"] = {{"requested_again", camera.counters.packets_requested_again},
                     {"resent", camera.counters.packets_resent},
                     {"repeated", camera.counters.packets_repeated}};
  json["buffer_underruns"] = camera.counters.buffer_underruns;
  json["frames_without_room"] = camera.frames_without_room;
  json["camera_host_launches"] = camera.host_launches;
  json["pixel_format"] = frame.pixel_format;
  json["bits"] = frame.bits;
  json["raw_file"] = frame.raw.empty() ? Json() : Json(raw_file(camera.name, frame));
  json["raw_sha256"] = frame.raw.empty() ? Json() : Json(sha256_of(frame.raw));
  json["mean_level"] = quality.mean;
  json["saturated_share"] = quality.saturated_fraction;
  json["sharpness_per_px"] = quality.sharpness;
  return json;
}

Json json_of(const StillReport& still, const StillOptions& options) {
  Json json;
  const std::vector<std::string> not_judged = still.not_judged();
  json["cloth"] = still.cloth_moved                       ? Json("moved")
                  : still.motion_px && not_judged.empty() ? Json("still")
                                                          : Json();
  if (!not_judged.empty()) json["not_judged"] = not_judged;
  json["motion_px"] = optional_json(still.motion_px);
  json["motion_limit_px"] = options.largest_motion_px;
  json["speed_mm_per_s"] = optional_json(still.speed_mm_per_s);
  json["sync_error_mm"] = optional_json(still.sync_error_mm);
  json["background_shift_px"] = optional_json(still.background_shift_px);
  json["background_shift_limit_px"] = options.largest_shift_px;
  json["cameras"] = Json::array();
  for (const CameraStill& c : still.cameras)
    json["cameras"].push_back({{"camera", c.name},
                               {"motion_px", optional_json(c.motion_px)},
                               {"speed_mm_per_s", optional_json(c.speed_mm_per_s)},
                               {"background_shift_px", optional_json(c.background_shift_px)}});
  return json;
}

}  // namespace

std::string raw_file(const std::string& camera, const LiveFrame& frame) {
  return camera + "." + frame.pixel_format + ".raw";
}

Json set_details(const std::string& name, const LiveSet& set,
                 const std::vector<FrameQuality>& qualities, std::size_t averaged,
                 const LiveReport& report, const StillReport& still, const RecordOptions& options,
                 const std::optional<std::string>& no_go) {
  Json json;
  json["schema"] = "drapebench/capture/1";
  json["set"] = name;
  if (no_go) json["no_go"] = *no_go;
  json["recorded_on"] = options.recorded_on;
  json["sync_method"] = to_string(report.method);
  json["fallen_back_because"] =
      report.why_fallen_back.empty() ? Json() : Json(report.why_fallen_back);
  json["paired_by"] = to_string(report.paired_by);
  json["trigger"] = set.trigger ? Json(*set.trigger) : Json();
  json["spread_ms"] = optional_json(set.spread_s, 1e3);
  json["spread_bound_ms"] = optional_json(set.spread_bound_s, 1e3);
  json["frames_averaged"] = averaged;
  json["stillness"] = json_of(still, options.still);
  json["cameras"] = Json::array();
  for (std::size_t c = 0; c < set.frames.size(); ++c)
    json["cameras"].push_back(camera_json(report.cameras[c], set.frames[c], qualities[c]));
  json["faults"] = Json::array();
  for (const LiveFault& f : report.faults)
    json["faults"].push_back(
        {{"camera", f.camera}, {"what", f.what}, {"to_do", f.what_to_do}, {"times", f.times}});
  return json;
}

}  // namespace drape::capture

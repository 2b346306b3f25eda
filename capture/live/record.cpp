// SPDX-License-Identifier: Apache-2.0
#include "capture/live/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

/// Frames of one set to be stored, one per camera.
struct Candidate {
  std::string name;
  std::optional<double> spread_s;
  std::optional<std::int64_t> trigger;
  std::vector<LiveFrame> frames;
  std::size_t averaged = 1;
};

bool is_usable_name(const std::string& name) {
  const auto fit = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || c == ' ';
  };
  return !name.empty() && name[0] != '.' && std::all_of(name.begin(), name.end(), fit);
}

std::vector<Candidate> sets_of(const LiveResult& live, const RecordOptions& options) {
  std::vector<Candidate> candidates;
  for (const PairedFrames& set : live.pairing.sets) {
    Candidate candidate{options.set, set.spread_s, set.trigger, {}};
    if (live.pairing.sets.size() > 1 && !options.average)
      candidate.name = fmt::format("{}_{:03}", options.set, candidates.size());
    for (const std::size_t i : set.frames) candidate.frames.push_back(live.frames[i]);
    candidates.push_back(std::move(candidate));
  }
  return candidates;
}

/// Mean of all candidates, rounded to the nearest level, times of the first.
Candidate average_of(const std::vector<Candidate>& candidates) {
  Candidate mean = candidates.front();
  mean.averaged = candidates.size();
  const auto count = static_cast<std::uint32_t>(candidates.size());
  for (const Candidate& c : candidates) {
    if (c.spread_s) mean.spread_s = std::max(mean.spread_s.value_or(0), *c.spread_s);
  }
  for (std::size_t camera = 0; camera < mean.frames.size(); ++camera) {
    std::vector<std::uint8_t>& pixels = mean.frames[camera].pixels;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      std::uint32_t sum = 0;
      for (const Candidate& c : candidates) sum += c.frames[camera].pixels[i];
      pixels[i] = static_cast<std::uint8_t>((sum + count / 2) / count);
    }
  }
  return mean;
}

std::optional<LiveFault> fault_of(const Candidate& set, const CamerasFile& cameras,
                                  const RecordOptions& options) {
  const std::string which = fmt::format("set `{}`: ", set.name);
  if (set.spread_s && *set.spread_s > options.largest_spread_s)
    return LiveFault{"",
                     fmt::format("{}its frames are {:.3f} ms apart", which, 1e3 * *set.spread_s),
                     "use a trigger or an action command, or raise largest_spread_ms"};
  for (std::size_t c = 0; c < set.frames.size(); ++c) {
    const LiveFrame& frame = set.frames[c];
    const LiveCamera& camera = cameras.cameras[c];
    if (frame.width_px != *camera.settings.width_px ||
        frame.height_px != *camera.settings.height_px)
      return LiveFault{
          camera.name,
          fmt::format("{}the frame is {} x {} px, the rig says {} x {} px", which, frame.width_px,
                      frame.height_px, *camera.settings.width_px, *camera.settings.height_px),
          "correct width_px and height_px in rig.toml"};
    const FrameQuality quality = quality_of(frame.pixels, frame.width_px);
    if (const auto why = quality_fault(quality, options.limits))
      return LiveFault{camera.name, which + *why, quality_remedy(quality, options.limits)};
  }
  return std::nullopt;
}

RecordedFrame store_frame(const LiveFrame& frame, const std::string& file,
                          const std::string& camera, const RecordOptions& options) {
  const cv::Mat image(frame.height_px, frame.width_px, CV_8UC1,
                      const_cast<std::uint8_t*>(frame.pixels.data()));  // imencode only reads
  std::vector<std::uint8_t> bytes;
  const bool encoded = options.format == FrameFormat::png
                           ? cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1})
                           : cv::imencode(".pgm", image, bytes);
  if (!encoded) throw internal_error("a frame cannot be encoded", {.camera = camera});
  write_durable(options.folder / file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return {camera, file, sha256_of(bytes), frame.width_px, frame.height_px, frame.mark.time_s};
}

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
  json["offset_bound_us"] = 1e6 * clock->bound_s;
  json["samples"] = clock->samples;
  return json;
}

Json camera_json(const LiveCameraReport& camera, const LiveFrame& frame) {
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
  const FrameQuality quality = quality_of(frame.pixels, frame.width_px);
  json["mean_level"] = quality.mean;
  json["saturated_share"] = quality.saturated_share;
  json["sharpness_per_px"] = quality.sharpness;
  return json;
}

Json json_of(const StillReport& still, const StillOptions& options, std::size_t frames) {
  Json json;
  json["frames_compared"] = frames;
  json["cloth"] = still.motion_px ? Json(still.cloth_moved ? "moved" : "still") : Json();
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

void store_details(const Candidate& set, const LiveResult& live, const StillReport& still,
                   const RecordOptions& options) {
  const LiveReport& report = live.report;
  Json json;
  json["schema"] = "drapebench/capture/1";
  json["set"] = set.name;
  json["recorded_on"] = options.recorded_on;
  json["sync_method"] = to_string(report.method);
  json["fallen_back_because"] =
      report.why_fallen_back.empty() ? Json() : Json(report.why_fallen_back);
  json["trigger"] = set.trigger ? Json(*set.trigger) : Json();
  json["spread_ms"] = optional_json(set.spread_s, 1e3);
  json["frames_averaged"] = set.averaged;
  json["stillness"] = json_of(still, options.still, live.pairing.sets.size());
  json["cameras"] = Json::array();
  for (std::size_t c = 0; c < set.frames.size(); ++c)
    json["cameras"].push_back(camera_json(report.cameras[c], set.frames[c]));
  json["faults"] = Json::array();
  for (const LiveFault& f : report.faults)
    json["faults"].push_back({{"camera", f.camera}, {"what", f.what}, {"to_do", f.what_to_do}});
  write_json(options.folder / set.name / "capture.json", json);
}

Recording existing_or_new(const RecordOptions& options) {
  if (fs::exists(options.folder / "recording.json")) return read_recording(options.folder);
  return {options.folder, "capture", options.recorded_on, {}};
}

}  // namespace

void require_new_set(const RecordOptions& options) {
  if (!is_usable_name(options.set))
    throw usage_error(fmt::format("`{}` cannot be the name of a set", options.set),
                      "use letters, digits, space, _, - and .");
  for (const FrameSet& set : existing_or_new(options).sets) {
    if (set.name != options.set && !set.name.starts_with(options.set + "_0")) continue;
    throw bad_input("the recording already holds this set",
                    {.file = (options.folder / "recording.json").string(), .set = set.name},
                    "give another --set; recorded images never change");
  }
}

RecordResult record_live(const LiveResult& live, const CamerasFile& cameras,
                         const RecordOptions& options) {
  require_new_set(options);
  Recording recording = existing_or_new(options);
  RecordResult result;
  result.still = look_still(live, cameras, options.still);
  result.refused = result.still.moved_cameras;
  const auto moved = result.still.cloth_fault();
  if (moved && options.average) result.refused.push_back(*moved);
  if (!result.refused.empty()) return result;
  std::vector<Candidate> good;
  for (Candidate& set : sets_of(live, options)) {
    if (auto fault = fault_of(set, cameras, options)) {
      result.refused.push_back(std::move(*fault));
    } else {
      good.push_back(std::move(set));
    }
  }
  if (options.average && !good.empty()) good = {average_of(good)};
  for (const Candidate& set : good) {
    FrameSet& stored = recording.sets.emplace_back(FrameSet{set.name, {}});
    stored.motion_px = result.still.motion_px;
    stored.camera_shift_px = result.still.background_shift_px;
    for (std::size_t c = 0; c < set.frames.size(); ++c) {
      const std::string& camera = cameras.cameras[c].name;
      const std::string file = fmt::format("{}/{}.{}", set.name, camera,
                                           options.format == FrameFormat::png ? "png" : "pgm");
      stored.frames.push_back(store_frame(set.frames[c], file, camera, options));
      result.files.push_back(file);
    }
    store_details(set, live, result.still, options);
    stored.details_sha256 = sha256_of_file(options.folder / set.name / "capture.json");
    result.sets.push_back(set.name);
  }
  if (!good.empty()) write_recording(recording);
  return result;
}

}  // namespace drape::capture

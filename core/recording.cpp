// SPDX-License-Identifier: Apache-2.0
#include "core/recording.hpp"

#include <fmt/format.h>

#include <set>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape {
namespace {

constexpr int kRecordingVersion = 1;

RecordedFrame read_recorded_frame(const JsonNode& node) {
  static_cast<void>(name_inside({}, node.text("file"), node.where("file")));
  return {node.name("camera"),       node.text("file"),
          node.text("sha256"),       node.integer("width_px"),
          node.integer("height_px"), node.optional_number("device_time_s")};
}

Json json_of(const RecordedFrame& frame) {
  return {{"camera", frame.camera},
          {"file", frame.file},
          {"sha256", frame.sha256},
          {"width_px", frame.width_px},
          {"height_px", frame.height_px},
          {"device_time_s", frame.device_time_s ? Json(*frame.device_time_s) : Json()}};
}

/// Each set once, and in it each camera once: which of two would be measured?
void check_unique(const JsonNode& root, const Recording& recording) {
  std::set<std::string> sets;
  for (const FrameSet& set : recording.sets) {
    if (!sets.insert(set.name).second)
      root.reject("sets", fmt::format("the set `{}` is there twice", set.name));
    std::set<std::string> cameras;
    for (const RecordedFrame& frame : set.frames)
      if (!cameras.insert(frame.camera).second)
        root.reject("sets", fmt::format("the camera `{}` is twice in the set `{}`", frame.camera,
                                        set.name));
  }
}

}  // namespace

const FrameSet& Recording::set(const std::string& set_name) const {
  std::string known;
  for (const FrameSet& candidate : sets) {
    if (candidate.name == set_name) return candidate;
    known += (known.empty() ? "" : ", ") + candidate.name;
  }
  throw bad_input("the recording has no such set",
                  {.file = (folder / "recording.json").string(), .set = set_name},
                  fmt::format("name one of: {}", known));
}

Recording read_recording(const std::filesystem::path& folder) {
  const std::filesystem::path manifest = folder / "recording.json";
  if (!std::filesystem::exists(manifest)) {
    throw bad_input(
        "not a recording: the manifest is missing", {.file = manifest.string()},
        "record with `drape capture`, or make it with `drape import FOLDER --out RECORDING`");
  }
  const JsonNode root = JsonNode::open(manifest, "recording", kRecordingVersion);
  Recording recording{folder, root.text("source"), root.optional_text("recorded_on"), {}};
  for (const JsonNode& set : root.items("sets")) {
    recording.sets.push_back({set.name("name"),
                              {},
                              set.optional_text("details_sha256"),
                              set.optional_number("motion_px"),
                              set.optional_number("camera_shift_px"),
                              set.optional_text("no_go")});
    for (const JsonNode& frame : set.items("frames"))
      recording.sets.back().frames.push_back(read_recorded_frame(frame));
  }
  check_unique(root, recording);
  if (recording.sets.empty()) {
    throw bad_input("the recording is empty: it lists no set",
                    {.file = manifest.string(), .field = "/sets"},
                    "record or import at least one set of images");
  }
  return recording;
}

void write_recording(const Recording& recording) {
  Json json;
  json["schema"] = fmt::format("drapebench/recording/{}", kRecordingVersion);
  json["source"] = recording.source;
  json["recorded_on"] = recording.recorded_on ? Json(*recording.recorded_on) : Json();
  json["sets"] = Json::array();
  for (const FrameSet& set : recording.sets) {
    Json item;
    item["name"] = set.name;
    item["frames"] = Json::array();
    for (const RecordedFrame& frame : set.frames) item["frames"].push_back(json_of(frame));
    if (set.details_sha256) item["details_sha256"] = *set.details_sha256;
    if (set.motion_px) item["motion_px"] = *set.motion_px;
    if (set.camera_shift_px) item["camera_shift_px"] = *set.camera_shift_px;
    if (set.no_go) item["no_go"] = *set.no_go;
    json["sets"].push_back(std::move(item));
  }
  write_json(recording.folder / "recording.json", json);
}

std::vector<unsigned char> read_frame(const Recording& recording, const FrameSet& set,
                                      const RecordedFrame& frame) {
  const std::filesystem::path file = recording.folder / frame.file;
  const Where where{.file = file.string(), .camera = frame.camera, .set = set.name};
  if (!std::filesystem::exists(file)) {
    throw bad_input("an image of the recording is missing", where,
                    "bring the image back, or record again");
  }
  std::vector<unsigned char> bytes = read_bytes(file);
  if (sha256_of(bytes) != frame.sha256) {
    throw bad_input("the image is not the one that was recorded: it was truncated or altered",
                    where, "bring the original image back, or record again");
  }
  return bytes;
}

}  // namespace drape

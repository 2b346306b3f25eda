// SPDX-License-Identifier: Apache-2.0
#include "core/recording.hpp"

#include <fmt/format.h>

#include <set>

#include "core/files/files.hpp"

namespace drape {

void fields(Fields& f, RecordedFrame& frame) {
  f(Field{"camera", "camera of the rig"}.plain_name(), frame.camera);
  f({"file", "image, relative to the recording"}, frame.file);
  f({"sha256", "SHA-256 of the file"}, frame.sha256);
  f({"width_px", "columns of the image", 1, 1}, frame.width_px);
  f({"height_px", "rows of the image", 1, 1}, frame.height_px);
  f({"device_time_s", "device time on the common clock, for live cameras"}, frame.device_time_s);
  if (!f.reads() || frame.file.empty()) return;
  try {
    static_cast<void>(name_inside({}, frame.file, {}));
  } catch (const Error& error) {
    f.limit(false, "file", error.what_failed(), error.what_to_do());
  }
}

void fields(Fields& f, FrameSet& set) {
  f(Field{"name", "name of the set"}.plain_name(), set.name);
  f({"frames", "one image per camera"}, set.frames);
  f.if_any({"details_sha256", "SHA-256 of the set's capture.json"}, set.details_sha256);
  f.if_any({"motion_px", "largest motion between frames of the burst"}, set.motion_px);
  f.if_any({"camera_shift_px", "largest shift of a background relative to the reference set"},
           set.camera_shift_px);
  f.if_any({"no_go", "reason why the set cannot be used as a measurement"}, set.no_go);
  // A camera may occur once only: with two images it is unclear which one to measure.
  std::set<std::string> cameras;
  for (const RecordedFrame& frame : set.frames)
    f.rule(cameras.insert(frame.camera).second, "frames",
           fmt::format("the camera `{}` is twice in the set `{}`", frame.camera, set.name),
           make_again);
}

void fields(Fields& f, Recording& recording) {
  f({"source", "import, or the capture method"}, recording.source);
  f({"recorded_on", "ISO date, if known"}, recording.recorded_on);
  f({"sets", "frame sets, each taken at one time"}, recording.sets);
  std::set<std::string> sets;
  for (const FrameSet& set : recording.sets)
    f.rule(sets.insert(set.name).second, "sets",
           fmt::format("the set `{}` is there twice", set.name), make_again);
}

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
  auto recording = read_record<Recording>(manifest);
  recording.folder = folder;
  if (recording.sets.empty()) {
    throw bad_input("the recording is empty: it lists no set",
                    {.file = manifest.string(), .field = "/sets"},
                    "record or import at least one set of images");
  }
  return recording;
}

void write_recording(const Recording& recording) {
  write_record(recording.folder / "recording.json", recording);
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

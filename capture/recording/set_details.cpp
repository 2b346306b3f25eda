// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/set_details.hpp"

#include "core/files/files.hpp"

namespace drape::capture {

void fields(Fields& f, CameraLedger& ledger) {
  f({"expected", "frames expected"}, ledger.expected);
  f({"in_set", "frames in sets"}, ledger.in_set);
  f({"unpaired", "frames without partners"}, ledger.unpaired);
  f({"incomplete", "frames with bytes missing"}, ledger.incomplete);
  f({"never_arrived", "frames that never came"}, ledger.never_arrived);
  f({"repeated_id", "frames whose id was seen before"}, ledger.repeated);
}

void fields(Fields& f, ClockFit& clock) {
  std::optional<double> drift_ppm;
  if (clock.drift_estimated) drift_ppm = clock.drift_ppm;
  double bound_s = clock.offset_bound_s();
  f({"drift_ppm", "rate of the host's clock over the camera's, minus 1"}, drift_ppm);
  f({"residual_us", "root mean square residual of the fit", 1e-6}, clock.residual_s);
  f({"offset_bound_us", "bound of the offset's error", 1e-6}, bound_s);
  f({"samples", "readings"}, clock.samples);
}

void fields(Fields& f, LiveFault& fault) {
  f({"camera", "name"}, fault.camera);
  f({"what", "fault"}, fault.what);
  f({"to_do", "remedy"}, fault.what_to_do);
  f({"times", "number of times"}, fault.times);
}

void fields(Fields& f, CameraDetails& camera) {
  LiveCameraReport& report = camera.report;
  std::vector<std::pair<std::string, std::string>> settings;
  for (const SettingReadBack& one : report.settings) settings.emplace_back(one.name, one.value);
  f({"camera", "name"}, report.name);
  f({"device", "identity that the camera states"}, report.identity);
  f({"settings_read_back", "settings that the camera states"}, settings);
  f({"frame_index", "count of the frame"}, camera.frame_index);
  f({"time_s", "device time on the common clock"}, camera.time_s);
  f({"clock_fit", "the camera's clock against the host's"}, report.clock);
  f({"ledger_frames", "frames up to then"}, report.ledger);
  f({"packets", "packets up to then"}, report.counters);
  f({"buffer_underruns", "frames without a buffer"}, report.counters.buffer_underruns);
  f({"frames_without_room", "frames that found no slot"}, report.frames_without_room);
  f({"camera_host_launches", "processes of this camera"}, report.host_launches);
  f({"pixel_format", "pixel format as sent"}, camera.pixel_format);
  f({"bits", "bits of a sample"}, camera.bits);
  f({"raw_file", "file of the bytes as sent, where the picture lacks some"}, camera.raw_file);
  f({"raw_sha256", "hash of that file"}, camera.raw_sha256);
  f({"mean_level", "mean grey level"}, camera.quality.mean);
  f({"saturated_share", "fraction of saturated pixels"}, camera.quality.saturated_fraction);
  f({"sharpness_per_px", "steepest edges over contrast"}, camera.quality.sharpness);
}

void fields(Fields& f, CameraStill& still) {
  f({"camera", "name"}, still.name);
  f({"motion_px", "largest motion"}, still.motion_px);
  f({"speed_mm_per_s", "speed of that motion"}, still.speed_mm_per_s);
  f({"background_shift_px", "shift against the reference set"}, still.background_shift_px);
}

namespace {

/// Table `stillness`.
struct Stillness {
  SetDetails& of;
};

void fields(Fields& f, Stillness& stillness) {
  StillReport& still = stillness.of.still;
  StillOptions& limits = stillness.of.still_options;
  std::vector<std::string> not_judged = still.not_judged();
  std::optional<std::string> cloth;
  if (still.cloth_moved) cloth = "moved";
  if (!cloth && still.motion_px && not_judged.empty()) cloth = "still";
  f({"cloth", "moved or still; null: not known"}, cloth);
  f.if_any({"not_judged", "cameras in which nothing could be followed"}, not_judged);
  f({"motion_px", "largest motion of the burst"}, still.motion_px);
  f({"motion_limit_px", "largest motion of a still cloth"}, limits.largest_motion_px);
  f({"speed_mm_per_s", "speed of that motion"}, still.speed_mm_per_s);
  f({"sync_error_mm", "motion during the spread"}, still.sync_error_mm);
  f({"background_shift_px", "shift against the reference set"}, still.background_shift_px);
  f({"background_shift_limit_px", "largest shift of a camera in place"}, limits.largest_shift_px);
  f({"cameras", "one for each camera"}, still.cameras);
}

/// The part of `stillness` that an import keeps.
struct StillnessNotes {
  SetNotes& of;
};

void fields(Fields& f, StillnessNotes& notes) {
  f({"cloth", "moved or still; null: not known"}, notes.of.cloth);
  f({"motion_px", "largest motion of the burst"}, notes.of.motion_px);
  f({"background_shift_px", "shift against the reference set"}, notes.of.camera_shift_px);
}

}  // namespace

void fields(Fields& f, SetDetails& details) {
  Stillness stillness{details};
  f(Field{"set", "name under which it was taken"}.plain_name(), details.set);
  f.if_any({"no_go", "reason why the set is no measurement"}, details.no_go);
  f({"recorded_on", "ISO date"}, details.recorded_on);
  f({"sync_method", "synchronisation that was used"}, details.method);
  f({"fallen_back_because", "reason why it is not the one wanted"}, details.fallen_back);
  f({"paired_by", "common property of the frames"}, details.paired_by);
  f({"trigger", "number of the trigger"}, details.trigger);
  f({"spread_ms", "latest minus earliest exposure", 1e-3}, details.spread_s);
  f({"spread_bound_ms", "interval that holds all exposures", 1e-3}, details.spread_bound_s);
  f({"frames_averaged", "frames of each camera"}, details.averaged);
  f({"stillness", "stillness of cloth and cameras"}, stillness);
  f({"cameras", "one for each camera"}, details.cameras);
  f({"faults", "faults seen up to then"}, details.faults);
}

void fields(Fields& f, SetNotes& notes) {
  StillnessNotes stillness{notes};
  f(Field{"set", "name under which it was taken"}.plain_name(), notes.set);
  f.if_any({"no_go", "reason why the set is no measurement"}, notes.no_go);
  f({"stillness", "stillness of cloth and cameras"}, stillness);
}

std::string raw_file(const std::string& camera, const LiveFrame& frame) {
  return camera + "." + frame.pixel_format + ".raw";
}

SetDetails set_details(const std::string& name, const LiveSet& set,
                       const std::vector<FrameQuality>& qualities, std::size_t averaged,
                       const LiveReport& report, const StillReport& still,
                       const RecordOptions& options, const std::optional<std::string>& no_go) {
  SetDetails details{name,
                     no_go,
                     {},
                     options.recorded_on,
                     report.method,
                     report.paired_by,
                     set.trigger,
                     set.spread_s,
                     set.spread_bound_s,
                     averaged,
                     still,
                     options.still,
                     {},
                     report.faults};
  if (!report.why_fallen_back.empty()) details.fallen_back = report.why_fallen_back;
  for (std::size_t c = 0; c < set.frames.size(); ++c) {
    const LiveFrame& frame = set.frames[c];
    CameraDetails& camera = details.cameras.emplace_back();
    camera.report = report.cameras[c];
    camera.frame_index = frame.mark.index;
    camera.time_s = frame.mark.time_s;
    camera.pixel_format = frame.pixel_format;
    camera.bits = frame.bits;
    camera.quality = qualities[c];
    if (frame.raw.empty()) continue;
    camera.raw_file = raw_file(camera.report.name, frame);
    camera.raw_sha256 = sha256_of(frame.raw);
  }
  return details;
}

}  // namespace drape::capture

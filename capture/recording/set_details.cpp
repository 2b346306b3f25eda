// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/set_details.hpp"

#include "core/files/files.hpp"

namespace drape::capture {

void fields(Fields& f, CameraLedger& ledger) {
  f({"expected", "expected frames"}, ledger.expected);
  f({"in_set", "frames used in sets"}, ledger.in_set);
  f({"unpaired", "frames without partners"}, ledger.unpaired);
  f({"incomplete", "incomplete frames"}, ledger.incomplete);
  f({"never_arrived", "frames that never arrived"}, ledger.never_arrived);
  f({"repeated_id", "frames with an id seen before"}, ledger.repeated);
}

void fields(Fields& f, ClockFit& clock) {
  std::optional<double> drift_ppm;
  if (clock.drift_estimated) drift_ppm = clock.drift_ppm;
  double bound_s = clock.offset_bound_s();
  f({"drift_ppm", "rate of the host's clock relative to the camera's, minus 1"}, drift_ppm);
  f({"residual_us", "root mean square residual of the fit", 1e-6}, clock.residual_s);
  f({"offset_bound_us", "upper bound of the offset's error", 1e-6}, bound_s);
  f({"samples", "number of clock readings"}, clock.samples);
}

void fields(Fields& f, LiveFault& fault) {
  f({"camera", "name of the camera"}, fault.camera);
  f({"what", "fault"}, fault.what);
  f({"to_do", "remedy"}, fault.what_to_do);
  f({"times", "number of occurrences"}, fault.times);
}

void fields(Fields& f, CameraDetails& camera) {
  LiveCameraReport& report = camera.report;
  std::vector<std::pair<std::string, std::string>> settings;
  for (const SettingReadBack& one : report.settings) settings.emplace_back(one.name, one.value);
  f({"camera", "name of the camera"}, report.name);
  f({"device", "identity reported by the camera"}, report.identity);
  f({"settings_read_back", "settings read back from the camera"}, settings);
  f({"frame_index", "frame counter"}, camera.frame_index);
  f({"time_s", "device time of the frame on the common clock"}, camera.time_s);
  f({"clock_fit", "fit of the camera's clock to the host's"}, report.clock);
  f({"ledger_frames", "frame counts up to this set"}, report.ledger);
  f({"packets", "packet counts up to this set"}, report.counters);
  f({"buffer_underruns", "frames lost for want of a buffer"}, report.counters.buffer_underruns);
  f({"frames_without_room", "frames dropped because no slot was free"}, report.frames_without_room);
  f({"camera_host_launches", "number of host processes started for this camera"},
    report.host_launches);
  f({"pixel_format", "pixel format as sent"}, camera.pixel_format);
  f({"bits", "bits per sample"}, camera.bits);
  f({"raw_file", "file of the bytes as sent, if the picture does not keep them all"},
    camera.raw_file);
  f({"raw_sha256", "SHA-256 of raw_file"}, camera.raw_sha256);
  f({"mean_level", "mean grey level"}, camera.quality.mean);
  f({"saturated_share", "fraction of saturated pixels"}, camera.quality.saturated_fraction);
  f({"sharpness_per_px", "slope of the steepest edges relative to the contrast"},
    camera.quality.sharpness);
}

void fields(Fields& f, CameraStill& still) {
  f({"camera", "name of the camera"}, still.name);
  f({"motion_px", "largest motion"}, still.motion_px);
  f({"speed_mm_per_s", "speed of that motion"}, still.speed_mm_per_s);
  f({"background_shift_px", "shift of the background relative to the reference set"},
    still.background_shift_px);
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
  f({"cloth", "moved or still; null if not known"}, cloth);
  f.if_any({"not_judged", "cameras in which no feature could be tracked"}, not_judged);
  f({"motion_px", "largest motion within the burst"}, still.motion_px);
  f({"motion_limit_px", "largest motion that counts as still"}, limits.largest_motion_px);
  f({"speed_mm_per_s", "speed of that motion"}, still.speed_mm_per_s);
  f({"sync_error_mm", "motion of the cloth during the spread"}, still.sync_error_mm);
  f({"background_shift_px", "shift of the background relative to the reference set"},
    still.background_shift_px);
  f({"background_shift_limit_px", "largest shift that counts as a camera in place"},
    limits.largest_shift_px);
  f({"cameras", "one entry per camera"}, still.cameras);
}

/// The part of `stillness` that an import keeps.
struct StillnessNotes {
  SetNotes& of;
};

void fields(Fields& f, StillnessNotes& notes) {
  f({"cloth", "moved or still; null if not known"}, notes.of.cloth);
  f({"motion_px", "largest motion within the burst"}, notes.of.motion_px);
  f({"background_shift_px", "shift of the background relative to the reference set"},
    notes.of.camera_shift_px);
}

}  // namespace

void fields(Fields& f, SetDetails& details) {
  Stillness stillness{details};
  f(Field{"set", "name of the set"}.plain_name(), details.set);
  f.if_any({"no_go", "reason why the set cannot be used as a measurement"}, details.no_go);
  f({"recorded_on", "ISO date"}, details.recorded_on);
  f({"sync_method", "synchronisation method used"}, details.method);
  f({"fallen_back_because", "reason why the preferred method was not used"}, details.fallen_back);
  f({"paired_by", "property by which frames were paired"}, details.paired_by);
  f({"trigger", "trigger number"}, details.trigger);
  f({"spread_ms", "latest minus earliest exposure", 1e-3}, details.spread_s);
  f({"spread_bound_ms", "upper bound of the spread", 1e-3}, details.spread_bound_s);
  f({"frames_averaged", "frames averaged per camera"}, details.averaged);
  f({"stillness", "stillness of cloth and cameras"}, stillness);
  f({"cameras", "one entry per camera"}, details.cameras);
  f({"faults", "faults seen up to this set"}, details.faults);
}

void fields(Fields& f, SetNotes& notes) {
  StillnessNotes stillness{notes};
  f(Field{"set", "name of the set"}.plain_name(), notes.set);
  f.if_any({"no_go", "reason why the set cannot be used as a measurement"}, notes.no_go);
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

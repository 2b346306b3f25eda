// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "capture/capture.hpp"
#include "core/parallel.hpp"

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

namespace fs = std::filesystem;

std::vector<FrameQuality> qualities_of(const LiveSet& set) {
  std::vector<FrameQuality> result(set.frames.size());
  parallel_for(result.size(), static_cast<int>(result.size()), [&](std::size_t c) {
    result[c] = quality_of(set.frames[c].pixels, set.frames[c].width_px);
  });
  return result;
}

std::optional<LiveFault> fault_of(const std::string& name, const LiveSet& set,
                                  const std::vector<FrameQuality>& qualities,
                                  const CamerasFile& cameras, const RecordOptions& options) {
  const std::string which = fmt::format("set `{}`: ", name);
  if (set.spread_s && *set.spread_s > options.largest_spread_s)
    return LiveFault{"",
                     fmt::format("{}its frames are {:.3f} ms apart", which, 1e3 * *set.spread_s),
                     "use a trigger or an action command, or raise largest_spread_ms"};
  for (std::size_t c = 0; c < set.frames.size(); ++c) {
    const LiveFrame& frame = set.frames[c];
    const LiveCamera& camera = cameras.cameras[c];
    if (!frame.fault.empty())
      return LiveFault{camera.name, which + frame.fault, "choose another pixel_format"};
    if (frame.width_px != *camera.settings.width_px ||
        frame.height_px != *camera.settings.height_px)
      return LiveFault{
          camera.name,
          fmt::format("{}the frame is {} x {} px, the rig says {} x {} px", which, frame.width_px,
                      frame.height_px, *camera.settings.width_px, *camera.settings.height_px),
          "correct width_px and height_px in rig.toml"};
    if (const auto why = quality_fault(qualities[c], options.limits))
      return LiveFault{camera.name, which + *why, quality_remedy(qualities[c], options.limits)};
  }
  return std::nullopt;
}

std::vector<std::uint8_t> encoded(const LiveFrame& frame, FrameFormat format,
                                  const std::string& camera) {
  const bool deep = !frame.deep.empty();
  const void* data = deep ? static_cast<const void*>(frame.deep.data()) : frame.pixels.data();
  const cv::Mat image(frame.height_px, frame.width_px, deep ? CV_16UC1 : CV_8UC1,
                      const_cast<void*>(data));  // imencode does not write
  std::vector<std::uint8_t> bytes;
  // OpenCV's default PNG uses one filter and run-length coding: half the time, and smaller files.
  if (!cv::imencode(format == FrameFormat::png ? ".png" : ".pgm", image, bytes))
    throw internal_error("a frame cannot be encoded", {.camera = camera});
  return bytes;
}

/// Names have at most 200 bytes, of which `_999` and `.take2147483647` need some.
constexpr std::size_t kLongestSetName = 185;

LiveFault too_few_frames(std::size_t averaged, int asked) {
  return {"", fmt::format("the average is of {} of {} frames", averaged, asked),
          "look at the reasons above, then take it once more under another name"};
}

/// Name of the file with a frame's raw bytes, in the set's folder.
std::string raw_file(const std::string& camera, const LiveFrame& frame) {
  return camera + "." + frame.pixel_format + ".raw";
}

SetDetails set_details(const std::string& name, const LiveSet& set,
                       const std::vector<FrameQuality>& qualities, std::size_t averaged,
                       const LiveReport& report, const StillReport& still,
                       const RecordOptions& options, const std::optional<std::string>& no_go) {
  const LiveSet moment{set.spread_s, set.spread_bound_s, set.trigger, {}};
  SetDetails details{name,     no_go, options.recorded_on, report, moment,
                     averaged, still, options.still,       {}};
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

}  // namespace

void fields(Fields& f, SetDetails& details) {
  Stillness stillness{details};
  std::optional<std::string> fallen_back;
  if (!details.report.why_fallen_back.empty()) fallen_back = details.report.why_fallen_back;
  f(Field{"set", "name of the set"}.plain_name(), details.set);
  f.if_any({"no_go", "reason why the set cannot be used as a measurement"}, details.no_go);
  f({"recorded_on", "ISO date"}, details.recorded_on);
  f({"sync_method", "synchronisation method used"}, details.report.method);
  f({"fallen_back_because", "reason why the preferred method was not used"}, fallen_back);
  f({"paired_by", "property by which frames were paired"}, details.report.paired_by);
  f({"trigger", "trigger number"}, details.moment.trigger);
  f({"spread_ms", "latest minus earliest exposure", 1e-3}, details.moment.spread_s);
  f({"spread_bound_ms", "upper bound of the spread", 1e-3}, details.moment.spread_bound_s);
  f({"frames_averaged", "frames averaged per camera"}, details.averaged);
  f({"stillness", "stillness of cloth and cameras"}, stillness);
  f({"cameras", "one entry per camera"}, details.cameras);
  f({"faults", "faults seen up to this set"}, details.report.faults);
}

void fields(Fields& f, SetNotes& notes) {
  StillnessNotes stillness{notes};
  f(Field{"set", "name of the set"}.plain_name(), notes.set);
  f.if_any({"no_go", "reason why the set cannot be used as a measurement"}, notes.no_go);
  f({"stillness", "stillness of cloth and cameras"}, stillness);
}

void require_set_name(const std::string& set) {
  bool fit =
      set.size() <= kLongestSetName && !set.starts_with("recording.") && !set.ends_with(".new");
  try {
    require_utf8_name(set, {});
  } catch (const Error&) {
    fit = false;
  }
  if (fit) return;
  throw usage_error(fmt::format("`{}` cannot be the name of a set", printable(set)),
                    fmt::format("use 1 to {} bytes without /, \\, comma or control characters, no "
                                "., - or `recording.` in front and no `.new` at the end",
                                kLongestSetName));
}

void require_cameras_of_rig(const Recording& recording, const CamerasFile& rig) {
  const auto refuse = [&](const std::string& what, const std::string& camera) {
    throw bad_input(what,
                    {.file = (recording.folder / "recording.json").string(), .camera = camera},
                    "give another --out, or the rig with which the recording was made");
  };
  std::set<std::string> recorded;
  for (const FrameSet& set : recording.sets)
    for (const RecordedFrame& frame : set.frames) {
      recorded.insert(frame.camera);
      const auto camera = std::ranges::find(rig.cameras, frame.camera, &LiveCamera::name);
      if (camera == rig.cameras.end())
        refuse("the recording has a camera that the rig does not have", frame.camera);
      const CameraSettings& is = camera->settings;
      if (frame.width_px != is.width_px || frame.height_px != is.height_px)
        refuse(fmt::format("the recording has images of {} x {} px, the rig says {} x {} px",
                           frame.width_px, frame.height_px, is.width_px.value_or(0),
                           is.height_px.value_or(0)),
               frame.camera);
    }
  for (const LiveCamera& camera : rig.cameras)
    if (!recorded.empty() && !recorded.contains(camera.name))
      refuse("the rig has a camera that the recording does not have", camera.name);
}

Recorder::Recorder(const CamerasFile& cameras, RecordOptions options, Journal& journal)
    : cameras_(cameras),
      options_((require_set_name(options.set), std::move(options))),
      journal_(journal),
      still_(cameras, options_.still) {
  require_cameras_of_rig(journal.recording(), cameras);
  for (const FrameSet& set : journal_.recording().sets) {
    const bool of_burst = options_.frames > 1 && set.name.starts_with(options_.set + "_0");
    if (set.name != folder_of(options_.set) && !of_burst) continue;
    throw bad_input("the recording already holds this set",
                    {.file = (options_.folder / "recording.json").string(), .set = set.name},
                    "give another --set; recorded images never change");
  }
}

std::optional<std::string> Recorder::reason_against() const {
  if (const auto moved = still_.report().cloth_fault()) return moved->what;
  return result_.short_average ? std::optional(result_.short_average->what) : std::nullopt;
}

std::string Recorder::folder_of(const std::string& set) const {
  return options_.retake ? set + ".new" : set;
}

void Recorder::add(LiveSet set, const LiveReport& report) {
  const std::string name = options_.frames > 1 && !options_.average
                               ? fmt::format("{}_{:03}", options_.set, taken_)
                               : options_.set;
  ++taken_;
  const auto qualities = qualities_of(set);
  if (auto fault = fault_of(name, set, qualities, cameras_, options_)) {
    add_fault(result_.refused, std::move(*fault));
    return;
  }
  still_.look(set);
  const auto& moved = still_.report().moved_cameras;
  if (!moved.empty()) {
    for (const LiveFault& fault : moved) add_fault(result_.refused, fault);
    return;
  }
  if (set.spread_bound_s) result_.spread_bounds_s.push_back(*set.spread_bound_s);
  if (options_.average) return sum_up(std::move(set), report);
  store(name, set, qualities, 1, report);
}

void Recorder::sum_up(LiveSet set, const LiveReport& report) {
  first_report_ = report;
  ++summed_;
  sums_.resize(set.frames.size());
  for (std::size_t c = 0; c < set.frames.size(); ++c) {
    const LiveFrame& frame = set.frames[c];
    sums_[c].resize(frame.pixels.size());
    for (std::size_t i = 0; i < sums_[c].size(); ++i)
      sums_[c][i] += frame.deep.empty() ? frame.pixels[i] : frame.deep[i];
  }
  if (!first_) {
    first_ = std::move(set);
    for (LiveFrame& frame : first_->frames) frame.raw.clear();
  } else if (set.spread_s) {
    first_->spread_s = std::max(first_->spread_s.value_or(0), *set.spread_s);
  }
}

void Recorder::store(const std::string& name, const LiveSet& set,
                     const std::vector<FrameQuality>& qualities, std::size_t averaged,
                     const LiveReport& report) {
  const std::string called = folder_of(name);
  const fs::path folder = journal_.begin(called);
  FrameSet stored{called, {}};
  stored.motion_px = still_.report().motion_px;
  stored.camera_shift_px = still_.report().background_shift_px;
  stored.no_go = reason_against();
  stored.frames.resize(set.frames.size());
  // Writes in parallel, so that the waits for the disk overlap.
  parallel_for(set.frames.size() + 1, static_cast<int>(set.frames.size()) + 1, [&](std::size_t c) {
    if (c == set.frames.size()) {
      const std::string details = text_of(set_details(name, set, qualities, averaged, report,
                                                      still_.report(), options_, stored.no_go));
      Journal::write(folder / "capture.json", details);
      stored.details_sha256 = sha256_of(details);
      return;
    }
    const LiveFrame& frame = set.frames[c];
    const std::string& camera = cameras_.cameras[c].name;
    const std::string file = camera + (options_.format == FrameFormat::png ? ".png" : ".pgm");
    const std::vector<std::uint8_t> bytes = encoded(frame, options_.format, camera);
    Journal::write(folder / file, as_text(bytes));
    if (!frame.raw.empty()) Journal::write(folder / raw_file(camera, frame), as_text(frame.raw));
    stored.frames[c] = {camera,         called + "/" + file, sha256_of(bytes),
                        frame.width_px, frame.height_px,     frame.mark.time_s};
  });
  for (const RecordedFrame& frame : stored.frames) result_.files.push_back(frame.file);
  journal_.add(std::move(stored), options_.frames > 1 ? options_.set : "");
  result_.sets.push_back(called);
}

RecordResult Recorder::finish() {
  const StillReport& still = still_.report();
  result_.averaged = summed_;
  if (first_) {
    if (summed_ < static_cast<std::size_t>(options_.frames))
      result_.short_average = too_few_frames(summed_, options_.frames);
    const auto moved = still.cloth_fault();
    if (moved) {
      add_fault(result_.refused, *moved);
    } else {
      for (std::size_t c = 0; c < sums_.size(); ++c) {
        LiveFrame& frame = first_->frames[c];
        const auto count = static_cast<std::uint32_t>(summed_);
        for (std::size_t i = 0; i < sums_[c].size(); ++i) {
          const std::uint32_t mean = (sums_[c][i] + count / 2) / count;
          if (frame.deep.empty()) {
            frame.pixels[i] = static_cast<std::uint8_t>(mean);
          } else {
            frame.deep[i] = static_cast<std::uint16_t>(mean);
            frame.pixels[i] = static_cast<std::uint8_t>(mean >> 8);
          }
        }
      }
      store(options_.set, *first_, qualities_of(*first_), summed_, first_report_);
    }
  }
  // The motion of the whole burst is only known now.
  for (FrameSet& set : journal_.recording().sets) {
    if (std::ranges::find(result_.sets, set.name) == result_.sets.end()) continue;
    set.motion_px = still.motion_px;
    set.camera_shift_px = still.background_shift_px;
    set.no_go = reason_against();
  }
  result_.still = still;
  return std::move(result_);
}

}  // namespace drape::capture

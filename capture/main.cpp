// SPDX-License-Identifier: Apache-2.0
// drape-capture: a capture or a session; import, verify, cameras and doctor.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <deque>
#include <limits>
#include <sstream>
#include <utility>

#include "capture/capture.hpp"
#include "capture/device/camera.hpp"
#include "capture/doctor/checks.hpp"
#include "capture/host/camera_host.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"
#include "core/fields/fields.hpp"
#include "core/fields/records.hpp"
#include "core/program/program.hpp"
#include "core/program/progress.hpp"
#include "core/program/run_record.hpp"
#include "core/program/words.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

Ending ending_of(const ImportResult& result, const std::filesystem::path& recording_folder) {
  const ImportReport& report = result.report;
  Ending ending;
  ending.verdict = fmt::format("imported {}{}", report.in_place ? "in place: " : "to ",
                               (recording_folder / "recording.json").string());
  ending.numbers = {{"sets", fmt::format("{}", result.recording.sets.size())},
                    {"cameras", fmt::format("{}", report.cameras.size())},
                    {"images", fmt::format("{} whole, {:.1f} MB", report.images,
                                           static_cast<double>(report.image_bytes) / 1e6)}};
  for (const auto& [file, reason] : report.ignored) {
    ending.rejected.push_back(fmt::format("{}: {}", file, reason));
  }
  ending.warnings = report.warnings;
  ending.advice = report.advice;
  ending.next_command =
      fmt::format("drape detect {} --rig RIG --surface target --sets SETS --out detections.json",
                  shell_word(recording_folder.string()));
  return ending;
}

/// Ending of a verification, which names every fault.
Ending ending_of(const VerifyReport& report) {
  Ending ending;
  ending.go = report.good();
  ending.verdict = report.good() ? "every image is as recorded" : "the recording is damaged";
  ending.numbers = {{"sets", fmt::format("{}", report.sets)},
                    {"images", fmt::format("{} listed, {} missing or altered", report.images,
                                           report.faults.size())}};
  for (const auto& [set, camera, file, what] : report.faults) {
    ending.rejected.push_back(
        fmt::format("set `{}`, camera `{}`, {}: {}", set, camera, file, what));
  }
  for (const std::string& file : report.not_listed) {
    ending.rejected.push_back(fmt::format("{}: not listed in recording.json", file));
  }
  for (const std::string& why : report.no_go)
    ending.warnings.push_back("no measurement, as recorded: " + why);
  for (const std::string& set : report.in_journal)
    ending.warnings.push_back(
        fmt::format("set `{}` is in the journal of a capture that goes on, or was ended; the next "
                    "capture takes it over",
                    set));
  return ending;
}

/// Describes a fault on one line, with the number of times it occurred.
std::string line_of(const LiveFault& fault) {
  return fmt::format("{}{}{}{}{}",
                     fault.camera.empty() ? "" : "camera `" + fault.camera + "`: ", fault.what,
                     fault.times > 1 ? fmt::format(" ({} times)", fault.times) : "",
                     fault.what_to_do.empty() ? "" : "; to do: ", fault.what_to_do);
}

std::string ledger_line(const LiveCameraReport& camera) {
  const CameraLedger& l = camera.ledger;
  std::string line =
      fmt::format("{} frames expected: {} in sets, {} unpaired, {} incomplete, {} never arrived",
                  l.expected, l.in_set, l.unpaired, l.incomplete, l.never_arrived);
  if (l.repeated > 0) line += fmt::format(", {} repeated", l.repeated);
  line += fmt::format("; {} packets resent", camera.counters.packets_resent);
  if (camera.frames_without_room > 0)
    line +=
        fmt::format("; {} found no room while this machine was busy", camera.frames_without_room);
  if (camera.longest_gap_s > 0)
    line += fmt::format("; lost: noticed after {:.2f} s, back {:.2f} s later",
                        camera.longest_unnoticed_s, camera.longest_gap_s);
  return line;
}

/// Ending of a capture: GO if every requested set was stored.
Ending ending_of(const LiveReport& report, const RecordResult& stored, int sets_wanted,
                 const std::filesystem::path& recording_folder) {
  Ending ending;
  const auto moved = stored.still.cloth_fault();
  const auto wanted = static_cast<std::size_t>(sets_wanted);
  ending.go =
      stored.refused.empty() && stored.sets.size() >= wanted && !moved && !stored.short_average;
  ending.verdict = stored.sets.empty()
                       ? "nothing was stored"
                       : fmt::format("{} of {} sets stored in {}", stored.sets.size(), wanted,
                                     (recording_folder / "recording.json").string());
  ending.numbers.emplace_back("sets", fmt::format("{}", fmt::join(stored.sets, ", ")));
  if (stored.averaged > 0)
    ending.numbers.emplace_back("averaged", fmt::format("{} frames", stored.averaged));
  ending.numbers.emplace_back("sync", name_of(report.method));
  if (report.paired_by == PairedBy::arrival)
    ending.numbers.emplace_back("paired by", "arrival: the spread of a set is not known");
  if (!stored.spread_bounds_s.empty())
    ending.numbers.emplace_back(
        "spread", fmt::format("not known without clocks; at most {:.0f} ms, from the trigger to "
                              "the last frame's arrival",
                              1e3 * *std::ranges::max_element(stored.spread_bounds_s)));
  if (!report.why_fallen_back.empty())
    ending.numbers.emplace_back("fallen back", report.why_fallen_back);
  if (stored.still.motion_px)
    ending.numbers.emplace_back(
        "cloth",
        fmt::format("{}: largest motion {:.3f} px{}", stored.still.cloth_moved ? "moved" : "still",
                    *stored.still.motion_px,
                    stored.still.sync_error_mm
                        ? fmt::format(", {:.2f} mm/s, {:.4f} mm during the spread",
                                      *stored.still.speed_mm_per_s, *stored.still.sync_error_mm)
                        : ""));
  if (stored.still.background_shift_px)
    ending.numbers.emplace_back(
        "background",
        fmt::format("{:.2f} px from the reference set at most", *stored.still.background_shift_px));
  for (const LiveCameraReport& camera : report.cameras)
    ending.numbers.emplace_back(camera.name, ledger_line(camera));
  for (const LiveCameraReport& camera : report.cameras)
    for (const SettingReadBack& one : camera.settings)
      if (const PixelFormat* format = find_pixel_format(one.value);
          one.name == "pixel_format" && format != nullptr && format->lossy())
        ending.warnings.push_back(
            fmt::format("{} sends {}, which is lossy: a dot's centre is less sure "
                        "(capture/README.md, Pixels)",
                        camera.name, one.value));
  if (const auto& why = stored.still.calibration_no_go)
    ending.warnings.push_back("no speed in mm/s: the calibration is NO-GO: " + *why);
  for (const std::string& camera : stored.still.not_judged())
    ending.warnings.push_back(
        fmt::format("{}: stillness could not be judged: its pictures have structure in one "
                    "direction only, or none above their noise",
                    camera));
  for (const LiveFault& fault : report.faults) ending.rejected.push_back(line_of(fault));
  if (moved) ending.rejected.push_back(line_of(*moved));
  if (stored.short_average) ending.rejected.push_back(line_of(*stored.short_average));
  for (const LiveFault& fault : stored.refused) ending.rejected.push_back(line_of(fault));
  ending.next_command =
      ending.go ? fmt::format("drape-capture verify {}", shell_word(recording_folder.string()))
                : "drape doctor RIG";
  return ending;
}

struct ImportOptions {
  fs::path folder, recording;
  CaptureOptions how;
};

void fields(Fields& f, ImportOptions& o) {
  f(Field{"folder", "FOLDER/<set>/<camera>.png|jpg|jpeg|tif|tiff"}.called("FOLDER"), o.folder);
  f({"out", "recording to write; FOLDER itself adds only the manifest"}, o.recording);
  f({"recorded_on", "date of the recording, e.g. 2026-01-31"}, o.how.recorded_on);
  f.otherwise({"allow_missing", "warn instead of failing if a set lacks a camera's image"},
              o.how.allow_missing);
  f.otherwise({"layout",
               "sets: FOLDER/<set>/<camera>.png; cameras: FOLDER/<camera>/<set>.png; names: all in "
               "FOLDER, e.g. left01.png or <set>_<camera>.png"},
              o.how.layout);
}

struct VerifyOptions {
  fs::path recording;
};

void fields(Fields& f, VerifyOptions& o) {
  f(Field{"recording", "folder with recording.json"}.called("RECORDING"), o.recording);
}

CaptureOptions options_with(CaptureOptions options, const CommonOptions& common,
                            Progress& progress) {
  options.threads = thread_count(common);
  options.progress = [&progress](double fraction, const std::string& file) {
    progress.update(fraction, file);
  };
  return options;
}

int import_command(int argc, char** argv) {
  const auto run = [](const ImportOptions& o, const std::vector<std::string>& words,
                      const CommonOptions& common) {
    require_importable(o.folder, o.recording,
                       o.how.layout);  // before the run record creates a folder
    const fs::path manifest = o.recording / "recording.json";
    RunRecord record("drape-capture", words, run_record_path(manifest));
    Progress progress("import", common.quiet);
    const ImportResult result =
        import_folder(o.folder, o.recording, options_with(o.how, common, progress));
    for (const auto& [file, sha256] : result.report.read) record.input(file, sha256);
    for (const FrameSet& set : result.recording.sets)
      if (const fs::path notes = o.folder / set.name / "capture.json"; fs::exists(notes))
        record.input(notes);
    record.output(manifest);  // recording.json holds the hashes of the copies
    return finish(ending_of(result, o.recording), common, record);
  };
  return run_command<ImportOptions>(
      argc, argv, "drape-capture import",
      "Makes a recording of images from elsewhere: FOLDER/<set>/<camera>.png|jpg|tif", run);
}

int verify_command(int argc, char** argv) {
  const auto run = [](const VerifyOptions& o, const CommonOptions& common) {
    Progress progress("verify", common.quiet);
    const auto report = verify_recording(o.recording, options_with({}, common, progress));
    finish(ending_of(report), common);
    return report.good() ? 0 : static_cast<int>(ErrorKind::bad_input);
  };
  return run_command<VerifyOptions>(
      argc, argv, "drape-capture verify",
      "Compares every image of a recording with the hash that was recorded", run);
}

struct CamerasArguments {
  bool sizes = false;
};
void fields(Fields& f, CamerasArguments& a) {
  f.otherwise({"sizes", "open each briefly to read its image size"}, a.sizes);
}

int cameras_command(int argc, char** argv) {
  const auto run = [](const CamerasArguments& given, const CommonOptions& common) {
    const auto devices = list_devices(camera_host_program(), given.sizes);
    if (common.json) {
      print_text(pretty(value_of(FoundDevices{devices})));
      return devices.empty() ? 1 : 0;
    }
    Ending ending;
    ending.go = !devices.empty();
    ending.verdict = ending.go ? fmt::format("{} camera(s) answer", devices.size())
                               : "no camera answers: check power, cable and network card";
    for (const auto& d : devices) {
      std::string line = fmt::format("{}, {} {}, {}", name_of(d.backend), d.identity.vendor,
                                     d.identity.model, d.identity.address);
      if (d.width_px && d.height_px) line += fmt::format(", {} x {} px", *d.width_px, *d.height_px);
      if (given.sizes && !d.why_not_asked.empty()) line += ", size not known: " + d.why_not_asked;
      ending.numbers.emplace_back(d.name, line);
    }
    ending.next_command = "drape doctor RIG";
    return finish(ending, common);
  };
  return run_command<CamerasArguments>(
      argc, argv, "drape-capture cameras",
      "Lists the cameras that answer: GigE Vision, USB3 Vision and V4L2. Takes about a second.\n"
      "`device` is what cameras.toml of a rig names.\n",
      run);
}

struct DoctorOptions {
  fs::path rig, out = ".";
  std::optional<fs::path> calibration;
};

void fields(Fields& f, DoctorOptions& o) {
  f(Field{"rig", "folder with rig.toml and cameras.toml"}.called("RIG"), o.rig);
  f.otherwise({"out", "folder for recordings, to check disk space and speed"}, o.out);
  f({"calibration", "calibration.json in use"}, o.calibration);
}

int tell(const std::vector<Check>& checks, const CommonOptions& common) {
  Value json, list(Value::List{});
  Ending ending;
  for (const auto& c : checks) {
    ending.go = ending.go && c.go;
    ending.numbers.emplace_back(c.name, fmt::format("{:<5}  {}", c.go ? "GO" : "NO-GO", c.found));
    if (!c.go) ending.rejected.push_back(fmt::format("{}; to do: {}", c.name, c.to_type));
    list.append(value_of(c));
  }
  ending.verdict = ending.go ? "the bench is fit to measure" : "the bench is not fit to measure";
  ending.next_command =
      ending.go ? "drape capture RIG --set NAME --out RECORDING" : "drape doctor RIG";
  if (!common.json) return finish(ending, common);
  json["verdict"] = ending.go ? "GO" : "NO-GO";
  json["checks"] = std::move(list);
  print_text(pretty(json));
  return ending.go ? 0 : 1;
}

int doctor_command(int argc, char** argv) {
  const auto run = [](const DoctorOptions& o, const CommonOptions& common) {
    return tell(check_all(look_at_bench(o.rig, o.out, o.calibration)), common);
  };
  return run_command<DoctorOptions>(
      argc, argv, "drape-capture doctor",
      "Checks whether the bench is fit to measure: GO or NO-GO for each check, and what to type.\n",
      run);
}

struct CaptureCommand {
  fs::path rig;
  RecordOptions storing;
  double patience_s = 20;
  fs::path preview;  ///< sessions only: folder for preview pictures of the cameras
};

void fields(Fields& f, CaptureCommand& c) {
  f(Field{"rig", "folder with rig.toml and cameras.toml"}.called("RIG"), c.rig);
  f.otherwise({"set", "name of the set to record; without it a session starts"}, c.storing.set);
  f({"out", "recording to make, or to add the set to"}, c.storing.folder);
  f.otherwise({"frames", "frames per camera: sets NAME_000, NAME_001, ...", 1, 1, 1000},
              c.storing.frames);
  f.otherwise({"average", "store one set, the mean of all frames"}, c.storing.average);
  f.otherwise({"format", "pgm is faster to write and takes twice the space"}, c.storing.format);
  f({"calibration", "calibration.json, to state the cloth's speed in mm/s"},
    c.storing.still.calibration);
  f.otherwise(
      {"preview",
       "for a session: folder, preferably in memory, in which each camera's picture is renewed"},
      c.preview);
  f.otherwise({"patience_s", "give up if no frame arrives for this time", 1, above_zero},
              c.patience_s);
  f.rule(!c.storing.set.empty() || (c.storing.frames == 1 && !c.storing.average), "set",
         "a session takes one frame of each camera at a time",
         "give --set NAME too, or leave out --frames and --average");
}

using Clock = std::chrono::steady_clock;
constexpr int kInterrupted = 130;
volatile std::sig_atomic_t interrupts = 0;

bool interrupted() {
  return interrupts > 0;
}

/// Lets Ctrl-C end the capture with the sets it has; a second Ctrl-C ends the program.
void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupts = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND | SA_RESTART);
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

RecordOptions storing_of(const CaptureCommand& command, const CamerasFile& cameras) {
  RecordOptions storing = command.storing;
  storing.largest_spread_s = cameras.largest_spread_s;
  storing.recorded_on = today();
  return storing;
}

LiveOptions live_options_of(const CaptureCommand& command) {
  LiveOptions options;
  options.frames = command.storing.frames;
  options.patience_s = command.patience_s;
  options.opening_s = std::max(options.opening_s, command.patience_s);
  options.host_program = camera_host_program();
  return options;
}

void add_inputs(const CaptureCommand& command, const CamerasFile& cameras, RunRecord& record) {
  record.input(cameras.rig_file);
  record.input(cameras.file);
  if (command.storing.still.calibration) record.input(*command.storing.still.calibration);
  if (!cameras.reference) return;
  const Recording reference = read_recording(cameras.reference->recording);
  for (const RecordedFrame& frame : reference.set(cameras.reference->set).frames)
    record.input(reference.folder / frame.file, frame.sha256);
}

/// Prints and stores the ending of a capture; returns the exit code.
int finish_capture(const Ending& ending, const CommonOptions& common, RunRecord& record,
                   const CaptureCommand& command, const Journal& journal) {
  const int code = interrupted() ? kInterrupted : ending.go ? 0 : 1;
  if (journal.changed()) {
    const fs::path manifest = command.storing.folder / "recording.json";
    record.output(manifest);  // recording.json holds the images' hashes
    record.write(run_record_path(manifest), code, ending);
  }
  finish(ending, common);
  return code;
}

void add_adopted(const Journal& journal, Ending& ending) {
  if (journal.adopted() > 0)
    ending.numbers.emplace_back(
        "adopted", fmt::format("{} sets of a capture that had been ended", journal.adopted()));
  for (const std::string& set : journal.gone())
    ending.rejected.push_back(
        fmt::format("set `{}` of a capture that had been ended: its images are gone", set));
}

/// Sets named in the rig, in the order in which they are recorded.
std::deque<std::string> sets_of_rig(const fs::path& rig_path) {
  const Rig rig = read_rig(rig_path);
  std::deque<std::string> sets;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  sets.insert(sets.end(), rig.free_poses.begin(), rig.free_poses.end());
  for (const fs::path& scene : rig.scenes) {
    try {
      if (const std::string set = read_scene(scene).set; !set.empty()) sets.push_back(set);
    } catch (const Error&) {  // a scene file that does not exist yet needs no set
    }
  }
  return sets;
}

/// Reads the operator's lines one at a time without blocking.
class Keyboard {
 public:
  /// The next line, nullopt if there is none yet; `ended` is true after the last one.
  std::optional<std::string> line() {
    pollfd wait{STDIN_FILENO, POLLIN, 0};
    char buffer[256];
    while (!ended && text_.find('\n') == std::string::npos && ::poll(&wait, 1, 0) > 0) {
      const ssize_t got = ::read(STDIN_FILENO, buffer, sizeof buffer);
      if (got <= 0) ended = true;
      if (got > 0) text_.append(buffer, static_cast<std::size_t>(got));
    }
    const std::size_t end = text_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    const std::string line = text_.substr(0, end);
    text_.erase(0, end + 1);
    return line;
  }
  bool ended = false;

 private:
  std::string text_;
};

/// Names and stores the sets of a session.
class SessionDesk {
 public:
  SessionDesk(const CaptureCommand& command, const CamerasFile& cameras)
      : cameras_(cameras),
        storing_(storing_of(command, cameras)),
        to_take_(sets_of_rig(command.rig)),
        patience_s_(command.patience_s),
        journal(storing_.folder, storing_.recorded_on) {
    require_cameras_of_rig(journal.recording(), cameras);
    storing_.frames = 1;
    std::erase_if(to_take_, [&](const std::string& s) { return journal.holds(s); });
  }

  LiveOptions::Demand demand() {
    using enum LiveOptions::Demand;
    if (!std::exchange(asked_, true)) ask();  // after the cameras have started to stream
    if (!wanted_.empty() && Clock::now() < give_up_at_) return take;
    if (!wanted_.empty()) {
      wanted_.clear();
      print_message("NO-GO: no whole set came; `drape doctor RIG` looks closer\n");
      ++refused;
      ask();
    }
    const auto line = keyboard_.line();
    if (!line) return keyboard_.ended ? end : wait;
    if (*line == "q") return end;
    try {
      light_ = light_of(*line);
      if (light_) return wait;
      if (line->starts_with("u ")) {
        restore(line->substr(2));
        return wait;
      }
      const bool again = *line == "r" || line->starts_with("r ");
      wanted_ = again              ? (line->size() > 2 ? line->substr(2) : last_)
                : !line->empty()   ? *line
                : to_take_.empty() ? ""
                                   : to_take_[0];
      require_set_name(wanted_);
      if (journal.holds(wanted_) != again)
        throw usage_error(
            fmt::format("set `{}` is {}", wanted_, again ? "not there" : "there"),
            again ? "type its name to take it" : fmt::format("`r {}` takes it once more", wanted_));
    } catch (const Error& error) {
      print_message(fmt::format("  {}; to do: {}\n", error.what_failed(), error.what_to_do()));
      wanted_.clear();
    }
    if (wanted_.empty()) ask();
    give_up_at_ = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                     std::chrono::duration<double>(patience_s_));
    return wanted_.empty() ? wait : take;
  }

  /// Returns a new exposure or gain from the operator once.
  std::optional<LiveOptions::Light> light() { return std::exchange(light_, std::nullopt); }

  void lit(std::size_t camera, const CameraHost& host, const CameraHost::LightAnswer& answer) {
    const std::string& name = cameras_.cameras[camera].name;
    if (!answer.refused.empty()) {
      print_message(fmt::format("NO-GO: {}\n", line_of({name, answer.refused, answer.what_to_do})));
      return;
    }
    std::string has;
    for (const SettingReadBack& one : host.settings())
      if (one.name.starts_with("exposure_") || one.name.starts_with("gain_"))
        has += fmt::format(", {} = {}", one.name, one.value);
    print_message(fmt::format("GO: {} has {}\n", name, has.empty() ? has : has.substr(2)));
  }

  void take(LiveSet set, const LiveReport& report) {
    RecordOptions storing = storing_;
    storing.set = std::exchange(wanted_, "");
    try {
      store(storing, std::move(set), report);
    } catch (const Error& error) {  // for example a full disk: the operator frees space and repeats
      print_message(fmt::format("NO-GO: {}; to do: {}\n", error.what_failed(), error.what_to_do()));
      ++refused;
    }
    ask();
  }

 private:
  void store(RecordOptions storing, LiveSet set, const LiveReport& report) {
    storing.retake = journal.holds(storing.set);
    Recorder recorder(cameras_, storing, journal);
    recorder.add(std::move(set), report);
    const RecordResult result = recorder.finish();
    for (const LiveFault& fault : result.refused)
      print_message(fmt::format("NO-GO: {}\n", line_of(fault)));
    refused += result.refused.size();
    if (result.sets.empty()) return;
    last_ = storing.set;
    // An earlier take is only renamed once its replacement is stored.
    if (storing.retake) journal.replace(last_);
    journal.publish();
    std::erase(to_take_, last_);
    print_message(fmt::format("GO: {} stored\n", last_));
    ++stored;
  }

  /// Undoes a retake.
  void restore(const std::string& set) {
    require_set_name(set);
    journal.restore(set);
    journal.publish();
    print_message(fmt::format("GO: {} restored\n", set));
    ask();
  }

  /// Parses `exposure_us 3000 cam0` or `gain_db 2 cam0`; nullopt for any other line.
  [[nodiscard]] std::optional<LiveOptions::Light> light_of(const std::string& line) const {
    std::istringstream words(line);
    std::string what, camera;
    double value = 0;
    words >> what;
    if (what != "exposure_us" && what != "gain_db") return std::nullopt;
    LiveOptions::Light light;
    std::optional<double>& to = what == "gain_db" ? light.wanted.gain_db : light.wanted.exposure_us;
    if (words >> value >> std::ws) to = value;
    std::getline(words, camera);
    const auto& all = cameras_.cameras;
    const auto found = std::ranges::find(all, camera, &LiveCamera::name);
    if (!to || found == all.end() || !std::isfinite(value) || value < 0 ||
        (value == 0 && what == "exposure_us"))
      throw usage_error(fmt::format("`{}` names no value and camera", line),
                        fmt::format("type `{} VALUE CAMERA`", what));
    if (what == "exposure_us" && cameras_.method == SyncMethod::free_run &&
        1e-6 * value > 1 / cameras_.frame_rate_hz)
      throw usage_error("a free-running camera exposes within its period",
                        fmt::format("give at most {:.0f} us, or lower frame_rate_hz",
                                    1e6 / cameras_.frame_rate_hz));
    light.camera = static_cast<std::size_t>(found - all.begin());
    return light;
  }

  void ask() const {
    print_message(fmt::format(
        "next: {}   (Enter takes it; or type a name; r: the last one again, r NAME: that "
        "one, u NAME: undo; "
        "exposure_us or gain_db, VALUE, CAMERA: set it; q: end)\n",
        to_take_.empty() ? "the rig names no more sets" : to_take_[0]));
  }

  const CamerasFile& cameras_;
  RecordOptions storing_;
  std::deque<std::string> to_take_;
  double patience_s_;
  Clock::time_point give_up_at_;
  std::string wanted_, last_;
  std::optional<LiveOptions::Light> light_;
  bool asked_ = false;
  Keyboard keyboard_;

 public:
  Journal journal;
  std::size_t stored = 0, refused = 0;
};

/// Runs a session: cameras stay open, and Enter takes the next set of the rig's list. The leader, a
/// person or the console, writes lines to standard input: the name of a set; empty: next of the
/// rig; `r`: retake the last one; `r NAME`: retake that one (the earlier take is kept as
/// NAME.take1); `u NAME`: undo that (the retake is kept as NAME.take2); `exposure_us 3000 CAMERA`
/// or `gain_db 2 CAMERA`: valid to the end; `q` or end of input: end. It reads from standard error:
/// `next: ...` when a line is expected, `GO: NAME stored` or `GO: NAME restored` once the set is in
/// recording.json, `GO: CAMERA has exposure_us = ...`, `NO-GO: reason; to do: ...`, and a line for
/// each camera that is lost or back; with --preview also `picture: CAMERA` for each new picture.
int run_session(const CaptureCommand& command, std::vector<std::string> arguments,
                const CommonOptions& common) {
  RunRecord record("drape-capture", std::move(arguments));
  const CamerasFile cameras = read_cameras_file(command.rig);
  add_inputs(command, cameras, record);
  // Refuses an unusable reference set now, before opening cameras, instead of at every set.
  if (cameras.reference) static_cast<void>(StillWatch(cameras, {}));
  SessionDesk desk(command, cameras);
  LiveOptions options = live_options_of(command);
  options.frames = std::numeric_limits<int>::max() / 16;
  options.demand = [&desk] { return desk.demand(); };
  options.on_set = [&desk](LiveSet set, const LiveReport& report) {
    desk.take(std::move(set), report);
  };
  options.light = [&desk] { return desk.light(); };
  options.on_light = [&desk](std::size_t camera, const CameraHost& host,
                             const CameraHost::LightAnswer& answer) {
    desk.lit(camera, host, answer);
  };
  options.ended = interrupted;
  options.on_camera = [](const LiveFault& fault) {
    print_message(fmt::format("{}\n", line_of(fault)));
  };
  std::optional<PreviewWriter> screen;
  if (!command.preview.empty()) {
    screen.emplace(cameras, command.preview);
    options.on_frame = [&screen, &cameras](std::size_t c, const HostFrame& frame,
                                           const CameraHost& host) {
      screen->show(c, develop(frame, host.pixel_format()), host.settings(), host.wanted());
      print_message(fmt::format("picture: {}\n", cameras.cameras[c].name));
    };
  }
  catch_interrupts();
  const LiveResult live = capture_live(cameras, options);
  desk.journal.publish();
  Ending ending;
  ending.go = desk.stored > 0 && !interrupted();
  ending.verdict = fmt::format("{} sets stored in {}", desk.stored,
                               (command.storing.folder / "recording.json").string());
  ending.numbers.emplace_back("refused", fmt::format("{}", desk.refused));
  ending.numbers.emplace_back("sync", name_of(live.report.method));
  add_adopted(desk.journal, ending);
  for (const LiveFault& fault : live.report.faults) ending.rejected.push_back(line_of(fault));
  ending.next_command =
      fmt::format("drape-capture verify {}", shell_word(command.storing.folder.string()));
  return finish_capture(ending, common, record, command, desk.journal);
}

int run_capture(const CaptureCommand& command, std::vector<std::string> arguments,
                const CommonOptions& common) {
  if (command.storing.set.empty()) return run_session(command, std::move(arguments), common);
  RunRecord record("drape-capture", std::move(arguments));
  const CamerasFile cameras = read_cameras_file(command.rig);
  add_inputs(command, cameras, record);
  RecordOptions storing = storing_of(command, cameras);
  require_set_name(storing.set);
  Journal journal(storing.folder, storing.recorded_on);
  Recorder recorder(cameras, storing, journal);

  Progress progress("capture", common.quiet);
  LiveOptions options = live_options_of(command);
  options.progress = [&progress](double done, const std::string& what) {
    progress.update(done, what);
  };
  options.on_set = [&recorder](LiveSet set, const LiveReport& report) {
    recorder.add(std::move(set), report);
  };
  options.ended = interrupted;
  catch_interrupts();
  const LiveResult live = capture_live(cameras, options);
  const RecordResult stored = recorder.finish();
  journal.publish();
  Ending ending =
      ending_of(live.report, stored, command.storing.average ? 1 : command.storing.frames,
                command.storing.folder);
  if (interrupted()) ending.go = false;
  add_adopted(journal, ending);
  return finish_capture(ending, common, record, command, journal);
}

int capture_command(int argc, char** argv) {
  return run_command<CaptureCommand>(
      argc, argv, "drape-capture",
      "Captures sets of frames from the cameras of a rig, makes recordings of images from\n"
      "elsewhere, and checks recordings.\n\n"
      "  drape-capture rigs/lab --set drape_A --out recording    one set, all cameras at once\n"
      "  drape-capture rigs/lab --out recording                  a session: Enter takes the next "
      "set\n"
      "  drape-capture import photos --out recording             photos/<set>/<camera>.png\n"
      "  drape-capture verify recording                          every image against its SHA-256\n",
      run_capture);
}

}  // namespace
}  // namespace drape::capture

int main(int argc, char** argv) {
  using namespace drape::capture;
  return drape::run_stage(
      argc, argv, capture_command,
      {{"import", import_command, "makes a recording from other images"},
       {"verify", verify_command, "checks that every image is as recorded"},
       {"cameras", cameras_command, "lists the cameras that answer"},
       {"doctor", doctor_command, "checks whether the bench is fit to measure"}});
}

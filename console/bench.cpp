// SPDX-License-Identifier: Apache-2.0
#include "console/bench.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/program/run_record.hpp"
#include "core/rules.hpp"

namespace drape::console {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kLongestNote = 2000, kLongestName = 80;
constexpr std::size_t kLeastSets = 3;  ///< for a calibration of all cameras together

fs::path out_of(const ConsoleOptions& options, const Rig& rig) {
  return options.out.empty() ? fs::path("out") / rig.name : options.out;
}

/// Live cameras record into the output folder, so that no recording that is there is added to.
fs::path recording_of(const ConsoleOptions& options, const Rig& rig) {
  if (!options.recording.empty()) return options.recording;
  return options.replay ? rig.recording : out_of(options, rig) / "recording";
}

std::string field(const Json& request, const char* name) {
  const auto found = request.find(name);
  if (found == request.end() || !found->is_string())
    throw bad_input(fmt::format("the request lacks `{}`", name), {}, "reload the page");
  return found->get<std::string>();
}

}  // namespace

Bench::Bench(const ConsoleOptions& options, Tell tell)
    : options_(options),
      rig_(read_rig(as_read(fs::is_directory(options.rig) ? options.rig / "rig.toml"
                                                          : fs::path(options.rig)))),
      target_(read_target(as_read(rig_.target_file))),
      out_(out_of(options, rig_)),
      own_(out_ / "console"),
      recording_folder_(recording_of(options, rig_)),
      tell_(std::move(tell)),
      lock_(own_ / ".lock", "another console works on this folder"),
      log_(own_ / "session.jsonl"),
      jobs_([this](const Job& job) { job_changed(job); },
            [this](const Job& job) { job_ended(job); }) {
  for (const fs::path& file : rig_.scenes) {
    const Scene scene = read_scene(as_read(file));
    static_cast<void>(as_read(scene.print_file));
    drapes_.push_back({scene, print_of(scene)});
  }
  read_layings();
  if (options_.replay) static_cast<void>(read_recording(recording_folder_));
  read_log();
  detect_what_lacks();
  if (options_.replay) return;
  std::vector<std::string> cameras;
  for (const RigCamera& camera : rig_.cameras) cameras.push_back(camera.name);
  watch_.emplace(std::move(cameras));
  open_cameras();
  live_marks_ = std::make_unique<LiveMarks>(
      [this] { return newest_pictures(); },
      [this](const fs::path& folder, const auto& px) { return live_rig_text(folder, px); });
}

/// The content that a file had when it was read, or just before.
const fs::path& Bench::as_read(const fs::path& file) {
  read_at_start_[file] = sha256_as_read(file);
  return file;
}

/// The cameras first, while all that they report to is there.
Bench::~Bench() {
  live_marks_.reset();
  std::unique_ptr<CaptureSession> closing;
  const std::lock_guard lock(capture_mutex_);
  closing.swap(capture_);
}

/// The state is what the log says was done and what the files hold.
void Bench::read_log() {
  std::vector<std::string> open;  ///< jobs that were asked for
  for (const Json& entry : log_.entries()) {
    if (entry.contains("taken")) {
      taken_[entry.value("taken", "")] = true;
      held_out_.erase(entry.value("taken", ""));
    }
    if (entry.contains("laying"))
      layings_.push_back({entry.value("drape", ""), entry.value("laying", ""),
                          entry.value("repeat", ""), entry.value("face", ""), true});
    if (entry.contains("face_of"))
      for (Laying& one : layings_)
        if (one.set == entry.value("face_of", "")) {
          one.face = entry.value("face", "");
          one.named = true;
        }
    if (entry.contains("dropped")) taken_[entry.value("dropped", "")] = false;
    if (entry.contains("operator")) operator_name_ = entry.value("operator", "");
    if (entry.contains("held_out")) held_out_[entry.value("held_out", "")] = entry;
    const auto of = [&](const char* key) {
      return std::find(open.begin(), open.end(), entry.value(key, ""));
    };
    if (entry.contains("asked") || (entry.contains("begins") && of("begins") == open.end()))
      open.push_back(entry.value("asked", entry.value("begins", "")));
    if (entry.value("ended", "") == "interrupted") open.clear();
    if (entry.contains("ended") && of("what") != open.end()) open.erase(of("what"));
  }
  if (!open.empty())
    log_.add(
        "bench",
        fmt::format("the server had ended before this was finished: {}", fmt::join(open, ", ")),
        {{"ended", "interrupted"}, {"sentence", "what was finished is kept; press it again"}});
  log_.add("bench", options_.replay ? "the console starts, on a recording" : "the console starts");
}

std::string Bench::operator_name() const {
  const std::lock_guard lock(mutex_);
  return operator_name_.empty() ? "operator" : operator_name_;
}

void Bench::act(const Json& request) {
  if (!request.is_object()) throw bad_input("the request is no object", {}, "reload the page");
  const std::string what = field(request, "do");
  if (what == "take" || what == "lay" || what == "measure" || what == "run") require_as_read();
  if (what == "take") {
    const std::string set = field(request, "set");
    require_set(set);
    if (request.contains("face") && plate_of(set) == nullptr && !drape_of(set).empty())
      name_face(set, field(request, "face"));
    take(set);
  } else if (what == "lay") {
    lay(field(request, "drape"));
  } else if (what == "light") {
    set_light(request);
  } else if (what == "drop") {
    drop(field(request, "set"));
  } else if (what == "calibrate") {
    calibrate();
  } else if (what == "measure") {
    measure(field(request, "drape"));
  } else if (what == "run") {
    run();
  } else if (what == "open") {
    open_cameras();
  } else if (what == "close") {
    close_cameras();
  } else if (what == "automatic") {
    const auto on = request.find("on");
    if (on == request.end() || !on->is_boolean())
      throw bad_input("the request lacks `on`", {}, "reload the page");
    automatic(on->get<bool>());
  } else if (what == "doctor") {
    ask_doctor();
  } else if (what == "note") {
    note(field(request, "text"));
  } else if (what == "operator") {
    name_operator(field(request, "name"));
  } else if (what == "cancel") {
    const auto id = request.find("job");
    if (id == request.end() || !id->is_number_integer() || !jobs_.cancel(id->get<int>()))
      throw bad_input("nothing that runs has this number", {}, "it may have ended already");
    log_.add(operator_name(), fmt::format("pressed cancel of {}", id->get<int>()));
  } else {
    throw bad_input("the server knows no such act", {.field = what}, "reload the page");
  }
  tell_("state", Json::object());
}

void Bench::take(const std::string& set) {
  require_set(set);
  if (!options_.replay) return take_live(set);
  static_cast<void>(recording()->set(set));
  log_.add(operator_name(), fmt::format("{} {}", is_taken(set) ? "took again" : "took", set),
           {{"taken", set}});
  taken(set);
}

void Bench::taken(const std::string& set) {
  {
    const std::lock_guard lock(mutex_);
    taken_[set] = true;
    if (taking_ == set) taking_.clear();
  }
  tell_("shot", {{"set", set}});
  detect(set);
}

void Bench::drop(const std::string& set) {
  require_set(set);
  if (!is_taken(set)) throw bad_input("the set was not taken", {.set = set}, "take it first");
  log_.add(operator_name(), "left out " + set, {{"dropped", set}});
  const std::lock_guard lock(mutex_);
  taken_[set] = false;
}

bool Bench::is_stage(const std::string& set) const {
  return std::any_of(rig_.stages.begin(), rig_.stages.end(),
                     [&](const TargetStage& stage) { return stage.set == set; });
}

bool Bench::can_calibrate() const {
  const std::vector<std::string> sets = taken_target_sets();
  return sets.size() >= kLeastSets && is_stage(sets.front());
}

void Bench::calibrate() {
  const std::vector<std::string> sets = taken_target_sets();
  if (!can_calibrate())
    throw bad_input(
        "a calibration needs a stage of the target, which is the world, and two more sets", {},
        "take them first");
  require_as_read();
  require_not_being_taken(sets);
  std::vector<Call> calls;
  for (const std::string& set : sets) calls.push_back(missing_detect_call(set));
  const bool free = !std::all_of(sets.begin(), sets.end(),
                                 [this](const std::string& set) { return is_stage(set); });
  calls.push_back(
      {{"calib", target_detections_file().string(), "--rig", calibration_rig_file().string(),
        "--method", free ? "joint" : "tsai", "--out", calibration_file().string()},
       [this, sets] {
         write_calibration_rig();
         merge_detections(sets);
       }});
  const std::string what = fmt::format("with {} sets", sets.size());
  ask("pressed calibrate " + what, "calibrate", what, std::move(calls));
}

void Bench::measure(const std::string& name) {
  const Drape& one = drape(name);
  const std::string& set = one.scene.set;
  if (!is_taken(set)) throw bad_input("the drape's set was not taken", {.set = set}, "take it");
  if (const auto why = against_calibration(calibration_file(), target_detections_file()))
    throw bad_input("the cameras are not calibrated: " + *why, {}, "calibrate first");
  require_not_being_taken(sets_of(one));
  std::vector<Call> calls = {missing_detect_call(set)};
  for (const ObjectTags& plate : one.scene.tags)
    if (is_taken(plate.set)) calls.push_back(missing_detect_call(plate.set));
  std::vector<Call> objects = object_calls(one);
  const std::size_t plates = objects.size();
  std::move(objects.begin(), objects.end(), std::back_inserter(calls));
  Call measured{{"triangulate", detections_file(set).string(), "--calibration",
                 calibration_file().string(), "--set", set, "--scene",
                 scene_file(one, plates).string(), "--out",
                 fs::path(sheet_file(name)).replace_extension(".ply").string()}};
  for (const ObjectTags& plate : one.scene.tags)
    if (is_taken(plate.set))
      measured.words.insert(measured.words.end(),
                            {"--object", object_file(name, plate.object).string()});
  measured.before = [this, set] {
    if (const auto why = against_calibration(calibration_file(), target_detections_file()))
      throw bad_input("the cameras are not calibrated: " + *why, {}, "calibrate, then measure");
    if (const auto why = against_marks(detections_file(set), set))
      throw bad_input("the marks are superseded: " + *why, {.set = set}, "measure again");
  };
  calls.push_back(std::move(measured));
  ask("pressed measure " + name, "measure", name, std::move(calls));
}

/// Where an object stands, as soon as its plate is measured.
void Bench::show_object(const std::string& set) {
  if (!calibration()) return;
  const std::string name = drape_of(set);
  if (std::vector<Call> calls = object_calls(drape(name)); !calls.empty())
    jobs_.add("object", name, std::move(calls));
}

void Bench::run() {
  const bool any = std::any_of(drapes_.begin(), drapes_.end(),
                               [&](const Drape& one) { return is_taken(one.scene.set); });
  if (!any) throw bad_input("no drape was taken", {}, "take one first");
  if (taken_target_sets().size() < kLeastSets)
    throw bad_input("the cameras are not calibrated", {}, "calibrate first");
  for (const Drape& one : drapes_)
    for (const ObjectTags& plate : one.scene.tags)
      if (is_taken(one.scene.set) && is_left_out(plate.set))
        throw bad_input("the plate of tags is left out, but the scene asks for it",
                        {.file = one.scene.file.string(), .field = "tags_set", .set = plate.set},
                        "take it, or take its tags_ lines out of the scene and start again");
  std::vector<std::string> sets = target_sets();
  for (const Drape& one : drapes_)
    for (std::string& set : sets_of(one)) sets.push_back(std::move(set));
  require_not_being_taken(sets);
  Call call{{"run", rig_file().string(), "--recording", recording_folder_.string(), "--out",
             out_.string()},
            [this] { write_rig(); }};
  {
    const std::lock_guard lock(mutex_);
    if (!operator_name_.empty()) call.words.push_back("--operator=" + operator_name_);
  }
  ask("pressed simulate and compare", "run", "all drapes that were taken", {std::move(call)});
}

void Bench::note(const std::string& text) {
  if (text.empty() || text.size() > kLongestNote)
    throw bad_input("a note has 1 to 2000 bytes", {}, "write it shorter");
  log_.add(operator_name(), "note", {{"note", text}});
}

void Bench::require_short_text(const std::string& text) {
  const bool plain =
      std::none_of(text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (text.size() > kLongestName || !plain)
    throw bad_input("a name has at most 80 bytes and no control characters", {},
                    "write it shorter");
}

void Bench::name_operator(const std::string& name) {
  require_short_text(name);
  log_.add(name.empty() ? "operator" : name, "is at the bench", {{"operator", name}});
  const std::lock_guard lock(mutex_);
  operator_name_ = name;
}

}  // namespace drape::console

// SPDX-License-Identifier: Apache-2.0
#include "console/session.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <sstream>

#include "console/console.hpp"
#include "core/statistics/sample.hpp"

namespace drape::console {

SessionLog::SessionLog(fs::path file, std::function<std::string()> clock)
    : file_(std::move(file)), clock_(std::move(clock)) {
  if (fs::exists(file_)) {
    const std::string text = read_text(file_);
    line_open_ = !text.empty() && text.back() != '\n';
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      Json entry = try_json(line);
      if (entry.is_object() && entry.contains("at")) {
        entries_.push_back(std::move(entry));
      } else if (!line.empty() && !(entry.is_object() && entry.contains("schema"))) {
        ++torn_;
      }
    }
  } else {
    write_durable(file_, "{\"schema\":\"drapebench/session-log/1\"}\n");
  }
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor_ < 0)
    throw bad_input(fmt::format("the session log cannot be written: {}", std::strerror(errno)),
                    {.file = file_.string()}, "check its permissions and the disk");
}

SessionLog::~SessionLog() {
  ::close(descriptor_);
}

void SessionLog::add(const std::string& who, const std::string& what, Json more) {
  const std::lock_guard lock(mutex_);
  Json entry = {{"at", clock_()}, {"who", who}, {"what", what}};
  for (auto& [key, value] : more.items()) entry[key] = value;
  // Bytes that are not UTF-8 would otherwise throw.
  std::string line = entry.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  if (line_open_) line.insert(0, "\n");
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t wrote = ::write(descriptor_, line.data() + done, line.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) {
      line_open_ = line_open_ || done > 0;
      throw bad_input(fmt::format("the session log cannot be written: {}", std::strerror(errno)),
                      {.file = file_.string()}, "free the disk; what was stored is whole");
    }
    done += static_cast<std::size_t>(wrote);
  }
  line_open_ = false;
  if (::fdatasync(descriptor_) != 0)
    throw bad_input(fmt::format("the session log is not on the disk: {}", std::strerror(errno)),
                    {.file = file_.string()}, "check the disk");
  entries_.push_back(try_json(line));
}

// ---- files of the bench ------------------------------------------------------------------------

namespace {

fs::path out_of(const ConsoleOptions& options, const fs::path& rig_file) {
  return options.out.empty() ? fs::path("out") / read_rig(rig_file).name : options.out;
}

/// Live cameras record into the output folder, so that no existing recording is changed.
fs::path recording_of(const ConsoleOptions& options, const fs::path& rig_file) {
  if (!options.recording.empty()) return options.recording;
  return options.replay ? read_rig(rig_file).recording : out_of(options, rig_file) / "recording";
}

std::shared_ptr<const BenchFiles> read_bench(const fs::path& rig_file) {
  BenchFiles bench;
  const auto stamped = [&](const fs::path& file) -> const fs::path& {
    bench.stamps.emplace_back(file, stamp_of(file));
    return file;
  };
  bench.rig = read_rig(stamped(rig_file));
  bench.target = read_target(stamped(bench.rig.target_file));
  for (const fs::path& file : bench.rig.scenes) {
    const Scene scene = read_scene(stamped(file));
    stamped(scene.print_file);
    bench.drapes.push_back({scene, print_of(scene)});
  }
  return std::make_shared<const BenchFiles>(std::move(bench));
}

}  // namespace

std::string stamp_of(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return {};
  return fmt::format("{} {} {}.{}", status.st_ino, status.st_size, status.st_mtim.tv_sec,
                     status.st_mtim.tv_nsec);
}

const Drape& BenchFiles::drape(const std::string& name) const {
  for (const Drape& one : drapes)
    if (one.scene.name == name) return one;
  throw bad_input("the rig has no such drape", {.field = name}, "reload the page");
}

const ObjectTags* BenchFiles::plate_of(const std::string& set) const {
  for (const Drape& one : drapes)
    for (const ObjectTags& plate : one.scene.tags)
      if (plate.set == set) return &plate;
  return nullptr;
}

std::vector<std::string> BenchFiles::target_sets() const {
  std::vector<std::string> sets;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  sets.insert(sets.end(), rig.free_poses.begin(), rig.free_poses.end());
  return sets;
}

Session::Session(const ConsoleOptions& asked, Tell told)
    : options(asked),
      rig_file(fs::is_directory(asked.rig) ? asked.rig / "rig.toml" : asked.rig),
      out(out_of(asked, rig_file)),
      own(out / "console"),
      recording_folder(recording_of(asked, rig_file)),
      tell(std::move(told)),
      lock(own / ".lock", "another console works on this folder"),
      log(own / "session.jsonl"),
      bench_(read_bench(rig_file)) {
  read_log();
}

std::shared_ptr<const BenchFiles> Session::bench() const {
  const std::lock_guard guard(mutex_);
  const auto is_read = [](const auto& one) { return stamp_of(one.first) == one.second; };
  if (std::all_of(bench_->stamps.begin(), bench_->stamps.end(), is_read)) return bench_;
  try {
    bench_ = read_bench(rig_file);
    bench_trouble_.clear();
  } catch (const Error& error) {
    bench_trouble_ = error.what();
  }
  return bench_;
}

std::vector<Laying> Session::layings(const std::string& drape) const {
  const auto files = bench();
  std::vector<Laying> all;
  for (const Drape& one : files->drapes)
    for (Laying& laying : layings_of(one.scene, files->rig)) all.push_back(std::move(laying));
  const std::lock_guard guard(mutex_);
  all.insert(all.end(), added_.begin(), added_.end());
  for (Laying& one : all)
    if (const auto face = faces_.find(one.set); face != faces_.end()) {
      one.face = face->second;
      one.named = true;
    }
  if (!drape.empty()) std::erase_if(all, [&](const Laying& one) { return one.drape != drape; });
  return all;
}

std::string Session::drape_of(const std::string& set) const {
  for (const Laying& one : layings())
    if (one.set == set) return one.drape;
  const auto files = bench();
  for (const Drape& one : files->drapes)
    for (const ObjectTags& plate : one.scene.tags)
      if (plate.set == set) return one.scene.name;
  return {};
}

std::vector<std::string> Session::sets_of(const Drape& drape) const {
  std::vector<std::string> sets;
  for (const ObjectTags& plate : drape.scene.tags) sets.push_back(plate.set);
  for (const Laying& one : layings(drape.scene.name)) sets.push_back(one.set);
  return sets;
}

void Session::require_set(const std::string& set) const {
  if (!bench()->is_target_set(set) && drape_of(set).empty())
    throw bad_input("the rig has no such set", {.field = set}, "reload the page");
}

void Session::add(const std::string& by, const std::string& what, Json more) {
  log.add(by, what, more);
  const std::lock_guard guard(mutex_);
  take_in(more);
}

void Session::take_in(const Json& entry) {
  const auto text = [&](const char* key) { return entry.value(key, ""); };
  if (entry.contains("taken")) {
    taken_[text("taken")] = true;
    held_out_.erase(text("taken"));
  }
  if (entry.contains("dropped")) taken_[text("dropped")] = false;
  if (entry.contains("laying"))
    added_.push_back({text("drape"), text("laying"), text("repeat"), text("face"), false, true});
  if (entry.contains("face_of")) faces_[text("face_of")] = text("face");
  if (entry.contains("operator")) operator_name_ = text("operator");
  if (entry.contains("held_out")) held_out_[text("held_out")] = entry;
}

/// Names the jobs that the previous server did not finish.
void Session::read_log() {
  std::vector<std::string> open;
  for (const Json& entry : log.entries()) {
    take_in(entry);
    const auto of = [&](const char* key) { return std::ranges::find(open, entry.value(key, "")); };
    if (entry.contains("asked") || (entry.contains("begins") && of("begins") == open.end()))
      open.push_back(entry.value("asked", entry.value("begins", "")));
    if (entry.value("ended", "") == "interrupted") open.clear();
    if (entry.contains("ended") && of("what") != open.end()) open.erase(of("what"));
  }
  if (!open.empty())
    log.add("bench",
            fmt::format("the server had ended before this was finished: {}", fmt::join(open, ", ")),
            {{"ended", "interrupted"}, {"sentence", "what was finished is kept; press it again"}});
  log.add("bench", options.replay ? "the console starts, on a recording" : "the console starts");
}

std::string Session::trouble() const {
  static_cast<void>(bench());
  const std::lock_guard guard(mutex_);
  return trouble_.empty() ? bench_trouble_ : trouble_;
}

// ---- what the programs' files say ---------------------------------------------------------------

namespace {

/// Number of file contents kept in memory: a calibration has some twenty sets. Keeping everything
/// ever read, 600 sets would take 60 MB.
constexpr std::size_t kMostKept = 64;

/// Tolerance of heights, which are written in mm with nine decimals and read back.
constexpr double kSameHeight_m = 1e-11;

/// The file with links to its folders resolved, as in records; the file's own name stays.
fs::path one_name(const fs::path& file) {
  const fs::path whole = fs::absolute(file).lexically_normal();
  std::error_code unreachable;
  return fs::weakly_canonical(whole.parent_path(), unreachable) / whole.filename();
}

bool is_below(const fs::path& file, const fs::path& folder) {
  const fs::path from = file.lexically_relative(folder);
  return !from.empty() && *from.begin() != "..";
}

Json detection_json(const MarkLattice& lattice, const std::vector<const FrameDetections*>& frames) {
  const int printed = lattice.rows * lattice.cols;
  Json cameras = Json::array();
  for (const FrameDetections* frame : frames) {
    std::map<std::string, int> reasons;
    for (const Rejection& one : frame->rejections) ++reasons[one.reason];
    const auto measured = static_cast<int>(frame->detections.size());
    const auto sigma = sigma_px(*frame);
    cameras.push_back({{"camera", frame->camera},
                       {"measured", measured},
                       {"missing", printed - measured},
                       {"tags", frame->tags.size()},
                       {"sigma_px", sigma ? Json(*sigma) : Json()},
                       {"rejected", reasons}});
  }
  return {{"printed", printed}, {"cameras", cameras}};
}

}  // namespace

std::optional<double> sigma_px(const FrameDetections& frame) {
  std::vector<double> all;
  for (const Detection& dot : frame.detections)
    all.push_back(std::sqrt(0.5 * dot.covariance_px2.trace()));
  if (all.empty()) return std::nullopt;
  return median(std::move(all));
}

Json ending_of(const fs::path& output) {
  const std::optional<Ending> ending = kept_ending(run_record_path(output));
  return ending ? try_json(one_line(value_of(*ending))) : Json{{"verdict", ""}, {"sentence", ""}};
}

// ---- paths -----------------------------------------------------------------------------------

/// Path of the marks as in the output of `drape run`.
fs::path Files::run_marks_file(const std::string& set) const {
  const auto bench = session_.bench();
  if (bench->is_target_set(set)) return session_.run.target_detections();
  if (const ObjectTags* plate = bench->plate_of(set))
    return session_.run.object(bench->drape(session_.drape_of(set)).scene, plate->object,
                               "-detections");
  for (const Laying& one : session_.layings())
    if (one.set == set) return session_.run.detections(one);
  return {};
}

/// Marks of the set's current pictures, from the first detection or from `drape run`.
fs::path Files::marks_file(const std::string& set) const {
  for (const fs::path& file : {look_file(set), run_marks_file(set)})
    if (is_made(file) && !why_superseded(file, set)) return file;
  return {};
}

/// Path for people: relative to the rig's folder if inside it, otherwise with its own folder.
std::string Files::shown(const fs::path& file) const {
  const fs::path folder = one_name(session_.rig_file).parent_path();
  return (is_below(file, folder) ? file.lexically_relative(folder)
                                 : file.parent_path().filename() / file.filename())
      .generic_string();
}

// ---- contents --------------------------------------------------------------------------------

/// nullptr while the file, or the record written after it, does not exist.
template <class T>
std::shared_ptr<const T> Files::kept(KeptFiles& files, const fs::path& file,
                                     T (*read)(const fs::path&)) const {
  const std::string stamp = stamp_of(file);
  if (stamp.empty()) return nullptr;
  const KeptFiles::key_type key{file, typeid(T)};
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = files.find(key); found != files.end() && found->second.stamp == stamp)
      return std::static_pointer_cast<const T>(found->second.content);
  }
  const auto content = std::make_shared<const T>(read(file));
  const std::lock_guard lock(mutex_);
  if (&files == &contents_ && files.size() >= kMostKept) files.clear();
  files[key] = {stamp, content};
  return content;
}

std::shared_ptr<const Recording> Files::recording() const {
  const auto read = [](const fs::path& file) { return read_recording(file.parent_path()); };
  const fs::path& folder = session_.recording_folder;
  if (auto found = kept<Recording>(contents_, folder / "recording.json", read)) return found;
  return std::make_shared<const Recording>(Recording{folder, "capture", {}, {}});
}

std::shared_ptr<const FrameSet> Files::recorded(const std::string& set) const {
  const auto all = recording();
  for (const FrameSet& one : all->sets)
    if (one.name == set) return {all, &one};
  return nullptr;
}

std::vector<std::string> Files::earlier_takes(const std::string& set) const {
  std::vector<std::string> sets;
  const auto all = recording();  // keeps alive what is searched
  for (const FrameSet& one : all->sets)
    if (one.name.starts_with(set + ".take")) sets.push_back(one.name);
  return sets;
}

Files::Facts Files::read_facts(const fs::path& file) {
  const Detections detections = read_detections(file);
  const Json ending = ending_of(file);
  std::map<std::string, std::vector<const FrameDetections*>> frames;
  for (const FrameDetections& frame : detections.frames) frames[frame.set].push_back(&frame);
  Facts all;
  for (const auto& [set, some] : frames) {
    SetFacts& facts = all[set];
    facts.detected = detection_json(detections.lattice, some);
    for (const FrameDetections* frame : some) facts.images[frame->camera] = frame->image_sha256;
    const auto no_go = detections.no_go.find(set);
    facts.verdict = no_go != detections.no_go.end() ? "NO-GO"
                    : frames.size() == 1            ? ending["verdict"]
                                                    : Json("GO");
    if (no_go != detections.no_go.end())
      facts.sentence = no_go->second;
    else if (frames.size() == 1)
      facts.sentence = ending["sentence"];
  }
  return all;
}

std::shared_ptr<const SetFacts> Files::facts(const std::string& set) const {
  try {
    const fs::path file = marks_file(set);
    const auto all = file.empty() ? nullptr : kept<Facts>(facts_, file, read_facts);
    if (!all || !all->contains(set)) return nullptr;
    return {all, &all->at(set)};
  } catch (const Error&) {  // damaged, so it is measured again
    return nullptr;
  }
}

std::shared_ptr<const Detections> Files::marks(const std::string& set) const {
  const fs::path file = marks_file(set);
  const auto all = file.empty() ? nullptr : kept<Detections>(contents_, file, read_detections);
  if (!all || file == look_file(set)) return all;
  auto some = std::make_shared<Detections>(*all);
  std::erase_if(some->frames, [&](const FrameDetections& frame) { return frame.set != set; });
  return some;
}

std::shared_ptr<const Calibration> Files::calibration() const {
  if (why_superseded(session_.run.calibration())) return nullptr;
  return kept<Calibration>(contents_, session_.run.calibration(), read_calibration);
}

std::shared_ptr<const Sheet> Files::sheet(const std::string& drape) const {
  if (why_superseded(sheet_file(drape))) return nullptr;
  return kept<Sheet>(contents_, sheet_file(drape), read_sheet);
}

std::shared_ptr<const RunFile> Files::record_of(const fs::path& output) const {
  return kept<RunFile>(facts_, run_record_path(output), read_run_file);
}

Scene Files::measured_scene(const Drape& drape) const {
  const std::vector<ObjectTags>& tags = drape.scene.tags;
  if (tags.empty()) return drape.scene;
  const fs::path by_run = session_.run.object(drape.scene, tags.back().object);
  if (is_made(by_run) && !why_superseded(by_run))
    return read_scene(session_.run.scene(drape.scene, tags.size()));
  std::size_t plates = 0;
  for (const ObjectTags& plate : tags) {
    if (!is_taken(plate.set)) continue;
    if (why_superseded(look().object(drape.scene, plate.object))) break;
    ++plates;
  }
  return plates == 0 ? drape.scene : read_scene(look().scene(drape.scene, plates));
}

Json Files::results(const std::vector<std::string>& words) const {
  const std::string stamp = stamp_of(session_.run.store());
  if (stamp.empty()) return {};
  Call call{{"results"}};
  call.words.insert(call.words.end(), words.begin(), words.end());
  call.words.insert(call.words.end(), {"--store", session_.run.store().string()});
  const std::string key = call.shown();
  {
    const std::lock_guard lock(mutex_);
    if (results_stamp_ != stamp) results_.clear();
    results_stamp_ = stamp;
    if (const auto found = results_.find(key); found != results_.end()) return found->second;
  }
  const StepResult end = run_call(call);
  if (end.exit_code > 1) return {};  // a run is writing it
  Json json = try_json(end.output);
  if (json.is_discarded()) return {};
  const std::lock_guard lock(mutex_);
  results_[key] = json;
  return json;
}

// ---- the one table ---------------------------------------------------------------------------

bool Files::is_taken(const std::string& set) const {
  if (const auto word = session_.word_on(set)) return *word;
  const auto record = record_of(run_marks_file(set));
  if (!record) return false;
  return std::any_of(record->inputs.begin(), record->inputs.end(), [&](const RecordedFile& one) {
    return std::find(one.sets.begin(), one.sets.end(), set) != one.sets.end();
  });
}

std::vector<std::string> Files::taken_target_sets() const {
  std::vector<std::string> sets = session_.bench()->target_sets();
  std::erase_if(sets, [&](const std::string& set) { return !is_taken(set); });
  return sets;
}

bool Files::is_made(const fs::path& output) const {
  return fs::is_regular_file(run_record_path(output));
}

/// Tests whether a file agrees with a record, once per content.
bool Files::holds(const fs::path& record, const RecordedFile& file) const {
  const fs::path place = place_of(record, file);
  const std::string stamp = stamp_of(place);
  const std::string key = place.string() + file.sha256 + file.values_sha256.value_or("");
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = holds_.find(key); found != holds_.end() && found->second.first == stamp)
      return found->second.second;
  }
  const bool so = is_as_recorded(record, file);
  const std::lock_guard lock(mutex_);
  holds_[key] = {stamp, so};
  return so;
}

Reason Files::why_superseded(const fs::path& output, const std::string& set) const {
  std::set<fs::path> seen;
  try {
    return superseded(one_name(output), set, seen);
  } catch (const Error& error) {
    return error.what();
  }
}

Reason Files::superseded(const fs::path& output, const std::string& set,
                         std::set<fs::path>& seen) const {
  const auto run = record_of(output);
  if (!run) return fmt::format("`{}` is not made", shown(output));
  const fs::path record = run_record_path(output);
  for (const RecordedFile& made : run->outputs)
    if (!holds(record, made))
      return fmt::format("`{}` is not as it was written", shown(one_name(place_of(record, made))));
  for (const RecordedFile& input : run->inputs) {
    for (const std::string& one : input.sets)
      if (set.empty() || one == set) {
        if (set.empty() && session_.word_on(one) == std::optional(false))
          return fmt::format("`{}` is left out", one);
        if (auto why = superseded_pictures(output, one)) return why;
      }
    if (!input.sets.empty()) continue;
    if (auto why = superseded_input(output, input, seen)) return why;
  }
  return std::nullopt;
}

/// Follows an input that another step made to its own inputs.
Reason Files::superseded_input(const fs::path& output, const RecordedFile& input,
                               std::set<fs::path>& seen) const {
  const fs::path record = run_record_path(output), file = one_name(place_of(record, input));
  if (!fs::is_regular_file(file)) return fmt::format("`{}` is gone", shown(file));
  const fs::path out = one_name(session_.out / "x").parent_path();
  const bool is_ours = is_below(file, out) && is_made(file);
  if (!holds(record, input))
    return fmt::format("`{}` was {} since", shown(file), is_ours ? "made again" : "edited");
  for (const fs::path& made : {out / "rig.toml", one_name(look().rig()), one_name(look_rig_file())})
    if (file == made) return rig_difference(file);
  if (file == one_name(session_.own / "acceptance.json")) {  // a copy of the rig's
    const fs::path source = session_.rig_file.parent_path() / "acceptance.json";
    if (!fs::is_regular_file(source) || sha256_of_file(source) != input.sha256)
      return "`acceptance.json` was edited since";
  }
  if (!is_ours || !seen.insert(file).second) return std::nullopt;
  auto why = superseded(file, {}, seen);
  if (why && file.filename() == "calibration.json") return "its calibration: " + *why;
  if (why && file.parent_path().parent_path().filename() == "repeats")
    return fmt::format("its laying `{}`: {}", file.parent_path().filename().string(), *why);
  return why;
}

/// A set can be retaken, or a picture replaced after its marks were measured.
Reason Files::superseded_pictures(const fs::path& marks, const std::string& set) const {
  const auto now = recorded(set);
  const auto all = kept<Facts>(facts_, marks, read_facts);
  std::map<std::string, std::string> images;
  if (now)
    for (const RecordedFrame& frame : now->frames) images[frame.camera] = frame.sha256;
  const bool is_seen = all && all->contains(set) && all->at(set).images == images;
  if (!is_seen || (now->no_go && all->at(set).verdict != "NO-GO"))
    return fmt::format("`{}` has other pictures now", set);
  for (const RecordedFrame& frame : now->frames)
    if (!holds(session_.recording_folder / "recording.json", {frame.file, frame.sha256}))
      return fmt::format("the picture `{}` is not as recorded", frame.file);
  return std::nullopt;
}

/// How the part of the rig read by a step differs from the current rig.
Reason Files::rig_difference(const fs::path& file) const {
  const auto read = [](const fs::path& path) { return read_rig(path); };
  const auto then = kept<Rig>(facts_, file, read);
  const auto bench = session_.bench();
  const Rig& now = bench->rig;
  const auto edited = [&](const std::string& what) {
    return fmt::format("`{}` was edited since: {}", shown(one_name(session_.rig_file)), what);
  };
  for (const TargetStage& stage : then->stages) {
    const auto found = std::ranges::find(now.stages, stage.set, &TargetStage::set);
    if (found == now.stages.end() || std::abs(found->z_m - stage.z_m) > kSameHeight_m)
      return edited(fmt::format("z_mm of `{}`", stage.set));
  }
  for (const std::string& pose : then->free_poses)
    if (!bench->is_target_set(pose)) return edited(fmt::format("`{}` is no free pose", pose));
  if (then->estimate_scale_x != now.estimate_scale_x) return edited("estimate_scale_x");
  for (const auto& [name, a, b] : {std::tuple("target", then->target_file, now.target_file),
                                   std::tuple("print", then->print_file, now.print_file)})
    if (!a.empty() && one_name(a) != one_name(b)) return edited(name);
  if (one_line(*value_of(*then).find("camera")) != one_line(*value_of(now).find("camera")))
    return edited("camera");
  return std::nullopt;
}

Reason Files::why_report_superseded(const Drape& drape) const {
  const fs::path report = one_name(session_.run.report()), folder = report.parent_path();
  const auto run = record_of(report);
  if (!run) return "the report is not finished";
  std::set<fs::path> seen;
  bool is_in_it = false;
  const auto bench = session_.bench();
  try {
    for (const RecordedFile& input : run->inputs) {
      const fs::path file = one_name(place_of(run_record_path(report), input));
      const bool of_another =
          std::any_of(bench->drapes.begin(), bench->drapes.end(), [&](const Drape& other) {
            return other.scene.name != drape.scene.name &&
                   (is_below(file, folder / other.scene.name) ||
                    file == one_name(other.scene.file));
          });
      if (of_another) continue;
      is_in_it = is_in_it || is_below(file, folder / drape.scene.name);
      if (auto why = superseded_input(report, input, seen)) return why;
    }
  } catch (const Error& error) {
    return error.what();
  }
  if (!is_in_it) return "the last report is not of this drape";
  return std::nullopt;
}

}  // namespace drape::console

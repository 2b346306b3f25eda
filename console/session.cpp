// SPDX-License-Identifier: Apache-2.0
#include "console/session.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <utility>

#include "core/scene.hpp"

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

std::vector<Json> SessionLog::entries() const {
  const std::lock_guard lock(mutex_);
  return entries_;
}

std::vector<Json> SessionLog::last(std::size_t most) const {
  const std::lock_guard lock(mutex_);
  const std::size_t count = std::min(most, entries_.size());
  return {entries_.end() - static_cast<std::ptrdiff_t>(count), entries_.end()};
}

std::size_t SessionLog::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
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

bool BenchFiles::is_stage(const std::string& set) const {
  return std::any_of(rig.stages.begin(), rig.stages.end(),
                     [&](const TargetStage& stage) { return stage.set == set; });
}

std::vector<std::string> BenchFiles::target_sets() const {
  std::vector<std::string> sets;
  for (const TargetStage& stage : rig.stages) sets.push_back(stage.set);
  sets.insert(sets.end(), rig.free_poses.begin(), rig.free_poses.end());
  return sets;
}

bool BenchFiles::is_target_set(const std::string& set) const {
  const auto& poses = rig.free_poses;
  return is_stage(set) || std::find(poses.begin(), poses.end(), set) != poses.end();
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

std::optional<bool> Session::word_on(const std::string& set) const {
  const std::lock_guard guard(mutex_);
  const auto found = taken_.find(set);
  return found == taken_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<Laying> Session::layings(const std::string& drape) const {
  const auto files = bench();
  std::vector<Laying> all;
  for (const Drape& one : files->drapes)
    all.push_back({one.scene.name, one.scene.set, one.scene.set, {}});
  for (const DrapeRepeat& repeat : files->rig.repeats) {
    Laying found{repeat.scene, repeat.set, repeat.repeat, repeat.face, true};
    const auto own_one = std::find_if(all.begin(), all.end(),
                                      [&](const Laying& one) { return one.set == found.set; });
    own_one == all.end() ? all.push_back(std::move(found)) : void(*own_one = std::move(found));
  }
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

std::string Session::who() const {
  const std::lock_guard guard(mutex_);
  return operator_name_.empty() ? "operator" : operator_name_;
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
    added_.push_back({text("drape"), text("laying"), text("repeat"), text("face"), true});
  if (entry.contains("face_of")) faces_[text("face_of")] = text("face");
  if (entry.contains("operator")) operator_name_ = text("operator");
  if (entry.contains("held_out")) held_out_[text("held_out")] = entry;
}

/// Names the jobs that the previous server did not finish.
void Session::read_log() {
  std::vector<std::string> open;
  for (const Json& entry : log.entries()) {
    take_in(entry);
    const auto of = [&](const char* key) {
      return std::find(open.begin(), open.end(), entry.value(key, ""));
    };
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

void Session::trouble(const std::string& words) {
  const std::lock_guard guard(mutex_);
  trouble_ = words;
}

std::string Session::trouble() const {
  static_cast<void>(bench());
  const std::lock_guard guard(mutex_);
  return trouble_.empty() ? bench_trouble_ : trouble_;
}

Json Session::held_out(const std::string& set) const {
  const std::lock_guard guard(mutex_);
  const auto found = held_out_.find(set);
  return found == held_out_.end() ? Json() : found->second;
}

Json Session::doctor() const {
  const std::lock_guard guard(mutex_);
  return doctor_;
}

void Session::doctor(Json checks) {
  const std::lock_guard guard(mutex_);
  doctor_ = std::move(checks);
}

}  // namespace drape::console

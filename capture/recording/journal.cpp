// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/record.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <map>
#include <sstream>
#include <utility>

#include "core/files/files.hpp"
#include "core/program/run_record.hpp"

namespace drape::capture {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnfinished = ".unfinished-";
constexpr int kEnding_ms = 2000;  ///< time until the kernel has ended a killed capture

fs::path journal_of(const fs::path& folder) {
  return folder / "recording.journal";
}

Error cannot_write(const fs::path& file) {
  return bad_input(fmt::format("cannot be written: {}", std::strerror(errno)),
                   {.file = file.string()}, "check the rights of the folder and the space on it");
}

/// A line of the journal: a set that is complete on disk, or a renaming.
struct JournalLine {
  std::optional<FrameSet> set = {};
  std::string burst = {};                 ///< burst to which the set belongs
  std::vector<std::string> renamed = {};  ///< old and new name
};

void fields(Fields& f, JournalLine& line) {
  f.if_any({"set", "set as listed in recording.json"}, line.set);
  f.if_any({"burst", "number of sets of the burst"}, line.burst);
  f.if_any(Field{"renamed", "old and new name"}.plain_name(), line.renamed);
  f.rule(line.set || line.renamed.size() == 2, "set", "the line says nothing", make_again);
}

/// Parses the complete lines, whose text is `whole`; one cut off was never acknowledged.
std::vector<JournalLine> lines_of(const std::string& text, const fs::path& journal,
                                  std::string& whole) {
  std::vector<JournalLine> lines;
  std::istringstream all(text);
  for (std::string one; std::getline(all, one); whole += one + "\n") {
    std::optional<Document> document;
    try {
      document.emplace(journal, Syntax::json, one);
    } catch (const Error&) {
      break;
    }
    if (!faults_of_reading(*document, walk_through(lines.emplace_back())).empty())
      throw bad_input("the journal of a capture that was ended is damaged",
                      {.file = journal.string()},
                      "move it away; the sets that recording.json lists are whole");
  }
  return lines;
}

/// Copies the last set's verdict: the motion of a burst applies to each of its sets.
void judge_like(const FrameSet& last, FrameSet& set) {
  set.motion_px = last.motion_px;
  set.camera_shift_px = last.camera_shift_px;
  set.no_go = last.no_go;
}

/// Throws for names that a reader refuses: one would make the whole recording unreadable.
void require_readable(const FrameSet& set, const Where& where) {
  require_plain_name(set.name, where);
  for (const RecordedFrame& frame : set.frames) {
    require_plain_name(frame.camera, where);
    static_cast<void>(name_inside({}, frame.file, where));
  }
}

bool is_there(const fs::path& folder, const FrameSet& set) {
  return std::ranges::any_of(
      set.frames, [&](const RecordedFrame& frame) { return fs::exists(folder / frame.file); });
}

void sync_folder(const fs::path& folder) {
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (descriptor.get() < 0 || ::fsync(descriptor.get()) != 0) throw cannot_write(folder);
}

}  // namespace

Journal::Journal(const fs::path& folder, std::string recorded_on)
    : is_new_(fs::create_directories(folder)) {
  lock_ = Descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (lock_.get() < 0) throw cannot_write(folder);
  for (int waited = 0; ::flock(lock_.get(), LOCK_EX | LOCK_NB) != 0; waited += 50) {
    if (errno != EWOULDBLOCK) throw cannot_write(folder);
    ::usleep(50'000);
    if (waited < kEnding_ms) continue;
    throw bad_input("another capture records into this folder", {.file = folder.string()},
                    "wait until it has ended, or give another --out");
  }
  recording_ = fs::exists(folder / "recording.json")
                   ? read_recording(folder)
                   : Recording{folder, "capture", std::move(recorded_on), {}};
  adopt();
}

/// Removes the folder if a capture stored nothing in it.
Journal::~Journal() {
  std::error_code ignored;
  if (is_new_ && recording_.sets.empty()) fs::remove_all(recording_.folder, ignored);
}

void Journal::adopt() {
  const fs::path folder = recording_.folder, journal = journal_of(folder);
  const auto known = static_cast<std::ptrdiff_t>(recording_.sets.size());
  if (fs::exists(journal)) {
    try {
      adopt_lines(read_text(journal));
      leave_out_gone(recording_.sets.begin() + known);
    } catch (const fs::filesystem_error& refused) {
      throw bad_input(
          "a set of a capture that was ended cannot be taken over: " + refused.code().message(),
          {.file = journal.string()},
          "see whether its folder is there; the sets that recording.json lists are whole");
    }
    waits_ = waits_ || adopted_ > 0;
    std::vector<std::string> retaken;
    for (auto set = recording_.sets.begin() + known; set != recording_.sets.end(); ++set)
      if (set->name.ends_with(".new")) retaken.push_back(set->name.substr(0, set->name.size() - 4));
    for (const std::string& set : retaken)
      if (holds(set) || !fs::exists(folder / set)) replace(set);
    publish();
  }
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().filename().string().starts_with(kUnfinished)) fs::remove_all(entry.path());
}

/// Drops missing sets after reading all lines, since only then each set has its final name.
void Journal::leave_out_gone(std::vector<FrameSet>::iterator first_adopted) {
  const auto gone =
      std::stable_partition(first_adopted, recording_.sets.end(),
                            [&](const FrameSet& set) { return is_there(recording_.folder, set); });
  // Keeps a retake that recording.json already has under its final name.
  for (auto set = gone; set != recording_.sets.end(); ++set)
    if (!is_renamed(recording_.folder, {recording_.sets.begin(), first_adopted}, *set))
      gone_.push_back(set->name);
  adopted_ -= static_cast<std::size_t>(recording_.sets.end() - gone);
  recording_.sets.erase(gone, recording_.sets.end());
}

void Journal::adopt_lines(const std::string& text) {
  const fs::path journal = journal_of(recording_.folder);
  std::map<std::string, std::vector<std::size_t>> bursts;
  std::string whole;
  for (JournalLine& line : lines_of(text, journal, whole)) {
    if (!line.set) {
      rename(line.renamed[0], line.renamed[1]);
      waits_ = true;
    } else if (adopt(std::move(*line.set)) && !line.burst.empty()) {
      std::vector<std::size_t>& burst = bursts[line.burst];
      burst.push_back(recording_.sets.size() - 1);
      // Only the last line has the motion of the whole burst.
      for (const std::size_t s : burst) judge_like(recording_.sets.back(), recording_.sets[s]);
    }
  }
  if (whole != text) write_durable(journal, whole);  // a partial line would hide those after it
}

bool Journal::adopt(FrameSet set) {
  if (holds(set.name)) return false;
  const fs::path unfinished = recording_.folder / (kUnfinished + set.name);
  if (fs::exists(unfinished)) fs::rename(unfinished, recording_.folder / set.name);
  recording_.sets.push_back(std::move(set));
  ++adopted_;
  return true;
}

fs::path Journal::begin(const std::string& set) const {
  fs::path unfinished = recording_.folder / (kUnfinished + set);
  fs::remove_all(unfinished);
  fs::create_directories(unfinished);
  return unfinished;
}

void Journal::write(const fs::path& file, std::string_view content) {
  const Descriptor descriptor(
      ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
  while (descriptor.get() >= 0 && !content.empty()) {
    const ssize_t wrote = ::write(descriptor.get(), content.data(), content.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) throw cannot_write(file);
    content.remove_prefix(static_cast<std::size_t>(wrote));
  }
  if (descriptor.get() < 0 || ::fsync(descriptor.get()) != 0) throw cannot_write(file);
}

void Journal::add(FrameSet set, const std::string& burst) {
  const fs::path folder = recording_.folder;
  require_readable(set, {.file = (folder / "recording.json").string(), .set = set.name});
  if (fs::exists(folder / set.name))
    throw bad_input("the folder of this set is there already, and is in no recording",
                    {.file = (folder / set.name).string(), .set = set.name},
                    "look what it holds, then remove it, or give another --set");
  sync_folder(folder / (kUnfinished + set.name));
  sync_folder(folder);
  write_line(one_line(value_of(JournalLine{set, burst})));
  fs::rename(folder / (kUnfinished + set.name), folder / set.name);
  sync_folder(folder);
  recording_.sets.push_back(std::move(set));
  waits_ = true;
}

bool Journal::holds(const std::string& set) const {
  return std::ranges::any_of(recording_.sets, [&](const FrameSet& s) { return s.name == set; });
}

int Journal::newest_take(const std::string& set) const {
  const std::string stem = set + ".take";
  int newest = 0;
  for (const FrameSet& one : recording_.sets)
    if (one.name.starts_with(stem))
      newest = std::max(newest, std::atoi(one.name.c_str() + stem.size()));
  return newest;
}

std::string Journal::free_take(const std::string& set) const {
  std::string name;
  for (int take = newest_take(set) + 1; name.empty() || fs::exists(recording_.folder / name);
       ++take)
    name = fmt::format("{}.take{}", set, take);
  require_plain_name(name, {.file = (recording_.folder / "recording.json").string(), .set = set});
  return name;
}

void Journal::replace(const std::string& set) {
  put_in_place(set + ".new", set);
}

void Journal::restore(const std::string& set) {
  const int newest = newest_take(set);
  if (newest == 0)
    throw usage_error(fmt::format("set `{}` was taken once only", set), "take it again with `r`");
  put_in_place(fmt::format("{}.take{}", set, newest), set);
}

void Journal::put_in_place(const std::string& from, const std::string& set) {
  std::vector<std::pair<std::string, std::string>> names{{from, set}};
  // A missing set means an undo killed half-way.
  if (holds(set)) names.insert(names.begin(), {set, free_take(set)});
  for (const auto& [before, after] : names) {
    write_line(one_line(value_of(JournalLine{.renamed = {before, after}})));
    rename(before, after);
  }
  waits_ = true;
}

/// Renames; folders renamed before an interruption stay as they are.
void Journal::rename(const std::string& from, const std::string& to) {
  const fs::path folder = recording_.folder;
  for (FrameSet& set : recording_.sets) {
    if (set.name != from || holds(to)) continue;
    set.name = to;
    for (RecordedFrame& frame : set.frames)
      frame.file = to + "/" + fs::path(frame.file).filename().string();
    if (!fs::exists(folder / to) && fs::exists(folder / from))
      fs::rename(folder / from, folder / to);
    sync_folder(folder);
    return;
  }
}

void Journal::write_line(const std::string& text) {
  const fs::path folder = recording_.folder;
  if (file_.get() < 0) {
    file_ = Descriptor(::open(journal_of(folder).c_str(),
                              O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0644));
    if (file_.get() < 0) throw cannot_write(journal_of(folder));
    sync_folder(folder);
  }
  const std::string line = text + "\n";
  const off_t before = ::lseek(file_.get(), 0, SEEK_END);
  if (::write(file_.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size()) &&
      ::fsync(file_.get()) == 0)
    return;
  const Error why = cannot_write(journal_of(folder));
  // A partial line would hide those after it.
  if (before < 0 || ::ftruncate(file_.get(), before) != 0) file_.reset();
  throw why;
}

std::vector<FrameSet> sets_in_journal(const fs::path& folder) {
  std::vector<FrameSet> sets;
  if (!fs::exists(journal_of(folder))) return sets;
  std::string whole;
  for (JournalLine& line : lines_of(read_text(journal_of(folder)), journal_of(folder), whole))
    if (line.set) sets.push_back(std::move(*line.set));
  return sets;
}

bool is_renamed(const fs::path& folder, std::span<const FrameSet> sets, const FrameSet& set) {
  return !is_there(folder, set) && std::ranges::any_of(sets, [&](const FrameSet& one) {
    return one.details_sha256 == set.details_sha256 &&
           std::equal(one.frames.begin(), one.frames.end(), set.frames.begin(), set.frames.end(),
                      [](const RecordedFrame& a, const RecordedFrame& b) {
                        return a.camera == b.camera && a.sha256 == b.sha256;
                      });
  });
}

void Journal::publish() {
  if (waits_ && !recording_.sets.empty()) {
    const fs::path record = run_record_path(recording_.folder / "recording.json");
    remove_durable(record);
    remove_durable(ending_path(record));
    write_recording(recording_);
    waits_ = false;
    changed_ = true;
  }
  file_.reset();
  fs::remove(journal_of(recording_.folder));
}

}  // namespace drape::capture

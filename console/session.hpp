// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <mutex>
#include <set>
#include <typeindex>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "core/recording.hpp"
#include "core/run_folder.hpp"
#include "core/sheet.hpp"

namespace drape::console {

namespace fs = std::filesystem;

/// Log of who did what when and with what result: a file of JSON lines that only grows. Each
/// line is on the disk before add() returns. A line torn by a crash is kept but skipped.
/// Thread-safe.
class SessionLog {
 public:
  /// Reads the file if it exists. `clock` returns the UTC time as text.
  explicit SessionLog(
      fs::path file, std::function<std::string()> clock = [] { return utc_text(); });
  ~SessionLog();

  /// Adds "at", "who" and "what" to the fields of `more` and appends the line. Throws
  /// Error(bad_input) with the system's reason if it cannot be written (disk full).
  void add(const std::string& who, const std::string& what, Json more = Json::object());

  [[nodiscard]] std::vector<Json> entries() const {
    const std::lock_guard lock(mutex_);
    return entries_;
  }
  /// Oldest first.
  [[nodiscard]] std::vector<Json> last(std::size_t most) const {
    const std::lock_guard lock(mutex_);
    return {entries_.end() - static_cast<std::ptrdiff_t>(std::min(most, entries_.size())),
            entries_.end()};
  }
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return entries_.size();
  }
  [[nodiscard]] int torn() const { return torn_; }  ///< number of incomplete lines

 private:
  fs::path file_;
  std::function<std::string()> clock_;
  mutable std::mutex mutex_;
  std::vector<Json> entries_;
  int torn_ = 0;
  int descriptor_ = -1;
  bool line_open_ = false;  ///< true if the file ends within a line
};

struct ConsoleOptions {
  fs::path rig;         ///< folder of the rig, or its rig.toml
  fs::path recording;   ///< empty for that of the rig
  fs::path out;         ///< empty for out/<rig name>, as in `drape run`
  bool replay = false;  ///< use the recording's sets instead of cameras
  std::string address = "127.0.0.1";
  int port = 8040;  ///< 0 for any free one
};

/// Called with the name and the JSON of an event.
using Tell = std::function<void(const std::string& name, const Json& data)>;

struct Drape {
  Scene scene;
  Print print;
};

/// Files of the bench that people edit: rig, target, scenes, prints.
struct BenchFiles {
  Rig rig;
  Target target;
  std::vector<Drape> drapes;
  std::vector<std::pair<fs::path, std::string>> stamps;  ///< files as they were read

  /// Throws Error(bad_input) if the rig has no such drape.
  [[nodiscard]] const Drape& drape(const std::string& name) const;
  [[nodiscard]] const ObjectTags* plate_of(const std::string& set) const;
  [[nodiscard]] std::vector<std::string> target_sets() const;  ///< stages, then free poses
  [[nodiscard]] bool is_target_set(const std::string& set) const {
    return std::ranges::count(target_sets(), set) > 0;
  }
};

/// Text that changes with every write and every replacement of a file; empty if it does not exist.
[[nodiscard]] std::string stamp_of(const fs::path& file);

/// State of the session: the bench's files, and the actions in its log. Everything else is in files
/// written by programs (Files). Thread-safe.
struct Session {
  /// Reads the log. Throws Error(bad_input) for a rig that cannot be read or a folder in use by
  /// another console.
  Session(const ConsoleOptions& asked, Tell told);

  const ConsoleOptions options;
  const fs::path rig_file;
  const fs::path out, own;  ///< the output folder, and the console's folder in it
  const RunFolder run{out};
  const fs::path recording_folder;
  const Tell tell;
  const WriterLock lock;
  SessionLog log;

  /// The current files, read again after an edit. If they cannot be read, the previous ones.
  [[nodiscard]] std::shared_ptr<const BenchFiles> bench() const;
  /// State of a set in the log: taken (true), excluded (false), or nullopt.
  [[nodiscard]] std::optional<bool> word_on(const std::string& set) const {
    const std::lock_guard guard(mutex_);
    const auto found = taken_.find(set);
    return found == taken_.end() ? std::nullopt : std::optional(found->second);
  }
  /// Layings of one drape, or of all: from the scenes, from rig.toml and from the operator.
  [[nodiscard]] std::vector<Laying> layings(const std::string& drape = {}) const;
  /// Drape shown in a set, or whose object carries the plate of tags; empty for the target.
  [[nodiscard]] std::string drape_of(const std::string& set) const;
  /// Sets of a drape in the order in which they are taken: those of the objects' plates first.
  [[nodiscard]] std::vector<std::string> sets_of(const Drape& drape) const;
  /// Throws Error(bad_input) if the rig has no such set.
  void require_set(const std::string& set) const;
  /// "operator" if no name was given.
  [[nodiscard]] std::string who() const {
    const std::lock_guard guard(mutex_);
    return operator_name_.empty() ? "operator" : operator_name_;
  }

  /// Adds an entry to the log and applies it, after it is on the disk.
  void add(const std::string& by, const std::string& what, Json more = Json::object());
  /// Fault of the log or the disk; empty when resolved.
  void trouble(const std::string& words) {
    const std::lock_guard guard(mutex_);
    trouble_ = words;
  }
  [[nodiscard]] std::string trouble() const;  ///< includes files of the bench that cannot be read
  /// Held-out error of a set, by the calibration before it.
  [[nodiscard]] Json held_out(const std::string& set) const {
    const std::lock_guard guard(mutex_);
    const auto found = held_out_.find(set);
    return found == held_out_.end() ? Json() : found->second;
  }
  /// Checks of the last `drape doctor`.
  [[nodiscard]] Json doctor() const {
    const std::lock_guard guard(mutex_);
    return doctor_;
  }
  void doctor(Json checks) {
    const std::lock_guard guard(mutex_);
    doctor_ = std::move(checks);
  }

 private:
  void take_in(const Json& entry);
  void read_log();

  mutable std::mutex mutex_;  ///< guards all members below
  mutable std::shared_ptr<const BenchFiles> bench_;
  mutable std::string bench_trouble_;
  std::map<std::string, bool> taken_;
  std::map<std::string, Json> held_out_;
  std::vector<Laying> added_;                 ///< added by the operator
  std::map<std::string, std::string> faces_;  ///< by set, as named by the operator
  std::string operator_name_, trouble_;
  Json doctor_;
};

// ---- what the programs' files say ---------------------------------------------------------------

/// Reason, for people, why a result is superseded; nullopt if it is what its inputs give now.
using Reason = std::optional<std::string>;

/// Detection results for the pictures of one set.
struct SetFacts {
  Json detected;                              ///< counts per camera
  std::map<std::string, std::string> images;  ///< SHA-256 by camera
  std::string verdict, sentence;
};

/// State derived from the files of the programs: what has been taken, measured, simulated and
/// reported, and which of it belongs to the current pictures and inputs. Each file is read once per
/// content. Thread-safe.
class Files {
 public:
  explicit Files(const Session& session) : session_(session) {}

  // ---- paths ---------------------------------------------------------------------------------
  [[nodiscard]] fs::path sheet_file(const std::string& drape) const {
    return session_.out / drape / "sheet.json";
  }
  /// Part of the rig that a first detection needs.
  [[nodiscard]] fs::path look_rig_file() const { return session_.own / "look.toml"; }
  /// The console's own first detection of marks in a set, or of an object's plate.
  [[nodiscard]] fs::path look_file(const std::string& set) const {
    return session_.own / "detections" / (set + ".json");
  }
  /// Objects at the positions measured by the console's own first detections, and the rig with the
  /// sets that were taken, for `drape run`.
  [[nodiscard]] RunFolder look() const { return {session_.own}; }

  // ---- the one table: what is taken, measured, reported, and what of it is superseded -----------
  // True if taken according to the log; otherwise if a run contains the set.
  [[nodiscard]] bool is_taken(const std::string& set) const;
  [[nodiscard]] std::vector<std::string> taken_target_sets() const;
  [[nodiscard]] bool is_made(const fs::path& output) const;  ///< whatever its inputs
  /// Checks the record of the output and those of its inputs. For a file of marks with several sets
  /// the check can be restricted to one.
  [[nodiscard]] Reason why_superseded(const fs::path& output, const std::string& set = {}) const;
  /// The same for the statements of the last report about a drape.
  [[nodiscard]] Reason why_report_superseded(const Drape& drape) const;

  // ---- contents; null if superseded -------------------------------------------------------------
  [[nodiscard]] std::shared_ptr<const Recording> recording() const;
  [[nodiscard]] std::shared_ptr<const FrameSet> recorded(const std::string& set) const;
  /// Sets replaced by a retake: capture keeps them as <set>.take1, .take2, ...
  [[nodiscard]] std::vector<std::string> earlier_takes(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const SetFacts> facts(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Detections> marks(const std::string& set) const;
  [[nodiscard]] std::shared_ptr<const Calibration> calibration() const;
  [[nodiscard]] std::shared_ptr<const Sheet> sheet(const std::string& drape) const;
  [[nodiscard]] std::shared_ptr<const RunFile> record_of(const fs::path& output) const;
  /// The scene with those objects whose plates were measured at their measured positions.
  [[nodiscard]] Scene measured_scene(const Drape& drape) const;
  /// Answer of `drape results`, requested once per content of the store; null without a store.
  [[nodiscard]] Json results(const std::vector<std::string>& words) const;

 private:
  struct Kept {
    std::string stamp;
    std::shared_ptr<const void> content;
  };
  /// Contents by file and type of what was read from it.
  using KeptFiles = std::map<std::pair<fs::path, std::type_index>, Kept>;
  using Facts = std::map<std::string, SetFacts>;  ///< by set

  template <class T>
  [[nodiscard]] std::shared_ptr<const T> kept(KeptFiles& files, const fs::path& file,
                                              T (*read)(const fs::path&)) const;
  static Facts read_facts(const fs::path& file);
  [[nodiscard]] bool holds(const fs::path& record, const RecordedFile& file) const;
  [[nodiscard]] fs::path run_marks_file(const std::string& set) const;
  [[nodiscard]] fs::path marks_file(const std::string& set) const;
  [[nodiscard]] std::string shown(const fs::path& file) const;
  Reason superseded(const fs::path& output, const std::string& set, std::set<fs::path>& seen) const;
  [[nodiscard]] Reason superseded_input(const fs::path& output, const RecordedFile& input,
                                        std::set<fs::path>& seen) const;
  [[nodiscard]] Reason superseded_pictures(const fs::path& marks, const std::string& set) const;
  [[nodiscard]] Reason rig_difference(const fs::path& made) const;

  const Session& session_;
  mutable std::mutex mutex_;    ///< guards all members below
  mutable KeptFiles contents_;  ///< at most kMostKept
  mutable KeptFiles facts_;     ///< small
  mutable std::map<std::string, std::pair<std::string, bool>> holds_;
  mutable std::map<std::string, Json> results_;
  mutable std::string results_stamp_;
};

/// Standard deviation of a dot's centre along one axis, as stated by detect (its bound): median
/// over the frame's marks.
[[nodiscard]] std::optional<double> sigma_px(const FrameDetections& frame);

/// Ending of a step, kept beside its output; verdict and sentence are empty if absent.
[[nodiscard]] Json ending_of(const fs::path& output);

}  // namespace drape::console

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/program/run_record.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

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
  SessionLog(const SessionLog&) = delete;
  SessionLog& operator=(const SessionLog&) = delete;

  /// Adds "at", "who" and "what" to the fields of `more` and appends the line. Throws
  /// Error(bad_input) with the system's reason if it cannot be written (disk full).
  void add(const std::string& who, const std::string& what, Json more = Json::object());

  [[nodiscard]] std::vector<Json> entries() const;
  [[nodiscard]] std::vector<Json> last(std::size_t most) const;  ///< oldest first
  [[nodiscard]] std::size_t size() const;
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

/// One laying of a drape's cloth; the set of the first one is the scene's.
struct Laying {
  std::string drape, set, repeat, face;
  bool named = false;  ///< named in rig.toml or by the operator
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
  [[nodiscard]] bool is_stage(const std::string& set) const;
  [[nodiscard]] std::vector<std::string> target_sets() const;  ///< stages, then free poses
  [[nodiscard]] bool is_target_set(const std::string& set) const;
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
  const fs::path recording_folder;
  const Tell tell;
  const WriterLock lock;
  SessionLog log;

  /// The current files, read again after an edit. If they cannot be read, the previous ones.
  [[nodiscard]] std::shared_ptr<const BenchFiles> bench() const;
  /// State of a set in the log: taken (true), excluded (false), or nullopt.
  [[nodiscard]] std::optional<bool> word_on(const std::string& set) const;
  /// Layings of one drape, or of all: from the scenes, from rig.toml and from the operator.
  [[nodiscard]] std::vector<Laying> layings(const std::string& drape = {}) const;
  /// Drape shown in a set, or whose object carries the plate of tags; empty for the target.
  [[nodiscard]] std::string drape_of(const std::string& set) const;
  /// Sets of a drape in the order in which they are taken: those of the objects' plates first.
  [[nodiscard]] std::vector<std::string> sets_of(const Drape& drape) const;
  /// Throws Error(bad_input) if the rig has no such set.
  void require_set(const std::string& set) const;
  [[nodiscard]] std::string who() const;  ///< "operator" if no name was given

  /// Adds an entry to the log and applies it, after it is on the disk.
  void add(const std::string& by, const std::string& what, Json more = Json::object());
  void trouble(const std::string& words);     ///< fault of the log or the disk; empty when resolved
  [[nodiscard]] std::string trouble() const;  ///< includes files of the bench that cannot be read
  [[nodiscard]] Json held_out(const std::string& set) const;  ///< by the calibration before it
  [[nodiscard]] Json doctor() const;                          ///< checks of the last `drape doctor`
  void doctor(Json checks);

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

}  // namespace drape::console

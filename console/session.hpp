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

#include "console/console.hpp"
#include "console/tasks/session_log.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"

namespace drape::console {

/// Called with the name and the JSON of an event.
using Tell = std::function<void(const std::string& name, const Json& data)>;

struct Drape {
  Scene scene;
  Print print;
};

/// One laying of a drape's cloth; the first one's set is the scene's.
struct Laying {
  std::string drape, set, repeat, face;
  bool named = false;  ///< in rig.toml, or by the operator
};

/// The files of the bench that people edit: rig, target, scenes, prints.
struct BenchFiles {
  Rig rig;
  Target target;
  std::vector<Drape> drapes;
  std::vector<std::pair<std::filesystem::path, std::string>> stamps;  ///< of the files when read

  /// Throws Error(bad_input) where the rig has no such drape.
  [[nodiscard]] const Drape& drape(const std::string& name) const;
  [[nodiscard]] const ObjectTags* plate_of(const std::string& set) const;
  [[nodiscard]] bool is_stage(const std::string& set) const;
  [[nodiscard]] std::vector<std::string> target_sets() const;  ///< stages, then free poses
  [[nodiscard]] bool is_target_set(const std::string& set) const;
};

/// Text that changes with every write and every replacement of a file; empty: it is not there.
[[nodiscard]] std::string stamp_of(const std::filesystem::path& file);

/// What the session knows: the bench's files, and what its log says was done. All else is a file
/// that a program wrote (Files). Safe from several threads.
struct Session {
  /// Reads the log. Throws Error(bad_input) for a rig that cannot be read or a folder on which
  /// another console works.
  Session(const ConsoleOptions& asked, Tell told);

  const ConsoleOptions options;
  const std::filesystem::path rig_file;
  const std::filesystem::path out, own;  ///< the output folder, and the console's part of it
  const std::filesystem::path recording_folder;
  const Tell tell;
  const WriterLock lock;
  SessionLog log;

  /// As the files are now: read again after an edit. While they cannot be read, as they were.
  [[nodiscard]] std::shared_ptr<const BenchFiles> bench() const;
  /// What the log says of a set: taken, left out, or nothing.
  [[nodiscard]] std::optional<bool> word_on(const std::string& set) const;
  /// Of one drape, or of all: of the scenes, of rig.toml, of the operator.
  [[nodiscard]] std::vector<Laying> layings(const std::string& drape = {}) const;
  /// Drape that a set shows, or whose object a plate of tags is on; empty: the target.
  [[nodiscard]] std::string drape_of(const std::string& set) const;
  /// Of a drape in the order in which a bench takes them: the objects' places first.
  [[nodiscard]] std::vector<std::string> sets_of(const Drape& drape) const;
  /// Throws Error(bad_input) where the rig has no such set.
  void require_set(const std::string& set) const;
  [[nodiscard]] std::string who() const;  ///< "operator" where nobody gave a name

  /// Logs, and keeps what the entry says: on the disk before it counts.
  void add(const std::string& by, const std::string& what, Json more = Json::object());
  void trouble(const std::string& words);     ///< fault of the log or the disk; empty: over
  [[nodiscard]] std::string trouble() const;  ///< with what cannot be read of the bench
  [[nodiscard]] Json held_out(const std::string& set) const;  ///< by the calibration before it
  [[nodiscard]] Json doctor() const;                          ///< checks of the last `drape doctor`
  void doctor(Json checks);

 private:
  void take_in(const Json& entry);
  void read_log();

  mutable std::mutex mutex_;  ///< guards everything below
  mutable std::shared_ptr<const BenchFiles> bench_;
  mutable std::string bench_trouble_;
  std::map<std::string, bool> taken_;
  std::map<std::string, Json> held_out_;
  std::vector<Laying> added_;                 ///< by the operator
  std::map<std::string, std::string> faces_;  ///< by set, as the operator names them
  std::string operator_name_, trouble_;
  Json doctor_;
};

}  // namespace drape::console

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/small_bench.hpp"

namespace drape::test {

/// A task of a user, with the folder prepared for it.
struct Situation {
  std::string name;
  std::function<void(const std::filesystem::path& folder)> prepare;
  std::string line;          ///< arguments of `drape`, run in that folder
  std::string verify = {};   ///< arguments of `drape` that must exit with 0 afterwards, or empty
  std::string store = {};    ///< file that the line writes, or empty
  std::string refused = {};  ///< printed by a second run if the first one's work is complete
  int exit_code = 0;         ///< of an undisturbed run
};

[[nodiscard]] std::vector<Situation> situations();
/// The other commands that write files, each alone; the slow ones only if DRAPE_CRASH_POINTS is
/// set.
[[nodiscard]] std::vector<Situation> single_commands();

/// The value of an environment variable.
[[nodiscard]] std::string environment(const char* name, const std::string& otherwise);

/// Texts by name, to be compared.
using Traces = std::map<std::string, std::string>;
[[nodiscard]] std::string difference(const Traces& found, const Traces& expected);

/// Folders of one situation: the initial state, and the result of an undisturbed run.
class CrashStage {
 public:
  explicit CrashStage(Situation situation);

  /// Number of calls in the undisturbed run that change files.
  [[nodiscard]] long calls() const { return calls_; }
  [[nodiscard]] double duration_s() const { return duration_s_; }

  /// Fault found after the call failed or the run died there and was restarted; empty if none.
  [[nodiscard]] std::string after_fault(long at, const std::string& with) const;

  /// The same for a kill at a given time of the run.
  [[nodiscard]] std::string after_kill_at(double time_s) const;

  /// The same for a power cut of the file system mounted on disk(); `at` beyond calls() means after
  /// the end. Without `synced` no call writes through.
  [[nodiscard]] std::string after_power_cut(long at, bool synced, const std::string& remount) const;

  /// Folder in which the runs happen.
  [[nodiscard]] std::filesystem::path disk() const { return folder_.path() / "disk"; }

 private:
  [[nodiscard]] Outcome run(const std::string& words) const;
  [[nodiscard]] std::string faulty(long at, const std::string& with,
                                   const std::string& more = {}) const;
  [[nodiscard]] Traces traces() const;
  [[nodiscard]] std::string after_second_run(const Outcome& first) const;
  /// Every run in the store with everything that depends on it, by key.
  [[nodiscard]] Traces runs() const;
  [[nodiscard]] std::string verified() const;
  void fresh() const;
  [[nodiscard]] std::filesystem::path begin() const { return folder_.path() / "begin"; }
  [[nodiscard]] std::filesystem::path counter() const { return folder_.path() / "counter"; }
  [[nodiscard]] std::filesystem::path work() const { return disk() / "work"; }

  Situation situation_;
  TemporaryFolder folder_;
  long calls_ = 0;
  double duration_s_ = 0;
  Traces expected_, expected_runs_;
};

}  // namespace drape::test

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {

/// A name that would run a script if not escaped; it can be one component of a path.
inline const std::string kScriptName =
    "\"><img src=x onerror=document.documentElement.dataset.ran=1><ran>";

/// A name that a spreadsheet would evaluate.
inline const std::string kFormulaName = "=HYPERLINK(\"x\")";

/// Content of a file that no hostile file may reveal.
inline const std::string kSecret = "SECRET-7261-OF-SOMEBODY-ELSE";

/// `lab/` has a finished small run (rig/, out/) and files from another lab; `outside/` next to it
/// has a secret that must neither change nor be read.
class HostileBench {
 public:
  HostileBench();

  [[nodiscard]] std::filesystem::path lab() const { return folder_.path() / "lab"; }
  [[nodiscard]] std::filesystem::path outside() const { return folder_.path() / "outside"; }

  void write(const std::string& file, const std::string& text) const;
  /// Replaces text in a file of lab(); throws if the text is not found.
  void replace(const std::string& file, const std::string& from, const std::string& to) const;
  /// Changes a JSON file of lab().
  void edit(const std::string& file, const std::function<void(Json&)>& change) const;

  /// Updates the records of the finished run to the current files, as an attacker
  /// would.
  void forge_records() const;

  /// Runs `drape` with these arguments in lab(), for at most 10 s of processor time.
  struct Met : Outcome {
    long memory_kB = 0;  ///< peak of its largest process
  };
  [[nodiscard]] Met run(const std::string& arguments) const;

  /// Harm done outside of lab() or in what was written: an effect, a leak, a script that is not
  /// escaped; empty if none.
  [[nodiscard]] std::string harm(const Outcome& outcome) const;

 private:
  TemporaryFolder folder_;
  std::map<std::string, std::string> before_;
};

/// A hostile file and the command that reads it.
struct HostileFile {
  std::string name;
  std::function<void(const HostileBench& bench)> make;
  std::string line;  ///< arguments of `drape`
};

[[nodiscard]] std::vector<HostileFile> hostile_names();
[[nodiscard]] std::vector<HostileFile> hostile_images();
[[nodiscard]] std::vector<HostileFile> hostile_numbers();
[[nodiscard]] std::vector<HostileFile> hostile_sizes();
[[nodiscard]] std::vector<HostileFile> hostile_stores();

}  // namespace drape::test

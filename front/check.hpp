// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/program/program.hpp"
#include "core/scene.hpp"

namespace drape {

/// All problems in the files of a bench, found in one pass before any work.
struct BenchCheck {
  std::vector<Error> problems;        ///< each with file, line or field, reason and remedy
  std::vector<std::string> warnings;  ///< unusual but possible values
  std::vector<std::string> advice;    ///< measurements that would improve the result
  int files = 0;                      ///< number of files read
  std::string purpose = "a run";      ///< intended use of the files

  /// Adds a problem; `path` as in Document::where.
  void add(const Document& document, const std::string& path, const std::string& what,
           const std::string& what_to_do) {
    add(bad_input(what, document.where(path), what_to_do));
  }
  void add(Error problem) { problems.push_back(std::move(problem)); }
  void add(std::vector<Error> faults) {
    for (Error& fault : faults) problems.push_back(std::move(fault));
  }
};

/// Reads rig, target, prints, scenes, fabrics and the recording's list. An empty `recording` means
/// that of the rig. For a virtual bench, a folder with scenes but no rig.toml, reads scenes, prints
/// and fabrics only. `calibrates`: the bench is only calibrated and needs no scene. Never throws
/// for the content of a file.
[[nodiscard]] BenchCheck check_bench(const std::filesystem::path& rig,
                                     const std::filesystem::path& recording,
                                     bool calibrates = false);

/// `drape check`: prints the results of check_bench(); returns the exit code.
[[nodiscard]] int report_check(const BenchCheck& check, const std::string& program,
                               const CommonOptions& common);

/// True if a drape's folder would collide with names that `drape run` or the console
/// use.
[[nodiscard]] bool is_name_of_a_run(const std::string& drape);

}  // namespace drape

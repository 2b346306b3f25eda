// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/program/program.hpp"
#include "core/recording.hpp"
#include "core/rules.hpp"

namespace drape {

/// Everything missing or wrong in the files of a bench, found in one reading before any work.
struct BenchCheck {
  std::vector<Error> problems;        ///< each with file, line or field, why and what to do
  std::vector<std::string> warnings;  ///< odd, but possible
  std::vector<std::string> advice;    ///< measures that make the result worth more
  int files = 0;                      ///< files that were read
  std::string purpose = "a run";      ///< use that the files are to serve

  /// Adds a problem; `path` as in Document::where.
  void add(const Document& document, const std::string& path, const std::string& what,
           const std::string& what_to_do) {
    problems.push_back(bad_input(what, document.where(path), what_to_do));
  }
  void add(std::vector<Error> faults) {
    for (Error& fault : faults) problems.push_back(std::move(fault));
  }
};

/// Reads rig, target, prints, scenes, fabrics and the recording's list. `recording` may be empty:
/// the rig's. Of a folder with scenes and no rig.toml, a virtual bench, scenes, prints and fabrics
/// alone. Never throws for what a file holds.
[[nodiscard]] BenchCheck check_bench(const std::filesystem::path& rig,
                                     const std::filesystem::path& recording);

/// `drape check`: prints what check_bench() found; returns the exit code.
[[nodiscard]] int report_check(const BenchCheck& check, const std::string& program,
                               const CommonOptions& common);

/// True where a drape's folder would stand where `drape run` and the console write under names of
/// their own.
[[nodiscard]] bool is_name_of_a_run(const std::string& drape);

/// Names and ends of a fabric's curves; its numbers and curves through `drape fabric`, the reader
/// that the simulation uses, with each of these numbers of segments.
void check_fabric(const std::filesystem::path& file, const std::vector<int>& segments,
                  BenchCheck& check);

/// Sets and cameras that the rig and its scenes need, image sizes, pictures that are not there or
/// stand there twice.
void check_recording(const Recording& recording, const Rig& rig, const std::vector<Scene>& scenes,
                     BenchCheck& check);

}  // namespace drape

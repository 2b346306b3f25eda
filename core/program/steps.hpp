// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace drape {

/// One program to run.
struct Step {
  std::string stage;  ///< for example "simulate"
  std::string what;   ///< for example "A, 31x31, 5 segments"
  std::filesystem::path program;
  std::vector<std::string> arguments;
  /// Files that the step must have written if it ends with a verdict.
  std::vector<std::filesystem::path> outputs = {};
  /// Shielded from Ctrl-C, since this process ends it; its standard error is that of this process.
  bool background = false;
  int niceness = 0;  ///< 19 for the lowest priority
};

struct StepResult {
  int exit_code = 0;
  std::string output;  ///< text on standard output
  std::string errors;  ///< text on standard error
  std::string fault;   ///< why its exit is invalid for a stage; empty if valid
};

/// Called with the fraction (0..1) and text of a running step; both are repeated while it reports
/// nothing, and the text is empty before its first report.
using StepProgress =
    std::function<void(std::size_t step, double fraction, const std::string& what)>;

/// Called when a step has ended, before the next one starts.
using StepEnded = std::function<void(std::size_t step, const StepResult& result)>;

/// Runs the steps in list order, at most `at_once` at a time. A failed step does not end the
/// others; the signal that `asked_to_end` returns (0: none) is passed on to the running ones and
/// ends the list. A step that ends with a verdict but without its outputs, or with an exit code
/// that no stage has, has a fault. Children die with this process, so a killed run leaves no writer
/// behind.
void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended, const std::function<int()>& asked_to_end);

}  // namespace drape

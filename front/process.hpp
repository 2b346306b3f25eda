// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace drape {

/// One stage program to start.
struct Step {
  std::string stage;  ///< "simulate"
  std::string what;   ///< "A, 31x31, 5 segments"
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path record;  ///< run record that proves it up to date
  double weight = 1;             ///< share of the stage's time
};

struct StepResult {
  int exit_code = 0;
  std::string output;  ///< what it printed on standard output
};

/// Fraction (0..1) and text of one running step.
using StepProgress =
    std::function<void(std::size_t step, double fraction, const std::string& what)>;

/// Runs the steps, at most `at_once` at a time, in order of the list; after the first that ends
/// with an exit code above 1 no further one is started. Errors of the programs go to stderr.
/// The children die with this process, so a killed run leaves no writer behind.
[[nodiscard]] std::vector<StepResult> run_steps(const std::vector<Step>& steps, int at_once,
                                                const StepProgress& progress);

/// Replaces this process by the program; throws Error when it cannot be started.
[[noreturn]] void become(const std::filesystem::path& program,
                         const std::vector<std::string>& arguments);

/// drape-<stage> beside the running program.
[[nodiscard]] std::filesystem::path stage_program(const std::string& stage);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"

namespace drape {

/// One stage program to start.
struct Step {
  std::string stage;  ///< "simulate"
  std::string what;   ///< "A, 31x31, 5 segments"
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path record;  ///< run record that proves it up to date
  double weight = 1;             ///< part of the stage's time
  /// Files that the step must have written when it ends with a verdict.
  std::vector<std::filesystem::path> outputs = {};
  std::string drape = {};       ///< whose failure stops this one alone; empty: all need it
  bool is_extra = false;        ///< without it less is said of a result, not something wrong
  bool is_measurement = false;  ///< leaves a measured sheet
  bool warns = false;  ///< its warnings are those of the result; else report and store have them
};

struct StepResult {
  int exit_code = 0;
  std::string output;  ///< text on standard output
  std::string errors;  ///< text on standard error
  std::string fault;   ///< why its end is none that a stage has; empty: it is one
};

/// Called when a step has ended, before the next one starts.
using StepEnded = std::function<void(std::size_t step, const StepResult& result)>;

/// Fraction (0..1) and text of one running step.
using StepProgress =
    std::function<void(std::size_t step, double fraction, const std::string& what)>;

/// While it lives, SIGINT and SIGTERM are remembered instead of ending the process.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] static int signal();  ///< the last one; 0: none
};

/// Runs the steps, at most `at_once` at a time, in order of the list; one that fails ends none of
/// the others, a signal is passed on to those that run and ends the list. A step that ends with a
/// verdict but has not written its outputs, or ends with a code that no stage has, has a fault. The
/// children die with this process, so a killed run leaves no writer behind.
void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended);

/// The error of a program that was started with --json, from what it printed, or its fault; nothing
/// without one.
[[nodiscard]] std::optional<Error> error_in(const StepResult& result);

/// The warnings of such a program.
[[nodiscard]] std::vector<std::string> warnings_in(const StepResult& result);

/// Runs a stage's program in silence.
[[nodiscard]] StepResult result_of_stage(const std::string& stage,
                                         std::vector<std::string> arguments);

/// The same; its error, or nothing when it ended well.
[[nodiscard]] std::optional<Error> error_of_stage(const std::string& stage,
                                                  std::vector<std::string> arguments);

/// Replaces this process by the program; throws Error when it cannot be started.
[[noreturn]] void become(const std::filesystem::path& program,
                         const std::vector<std::string>& arguments);

/// A command that is a word of a stage's program.
struct CommandWord {
  const char* name;          ///< "certify"
  const char *stage, *word;  ///< the words of `drape simulate certify`
  bool typed;                ///< `drape NAME` is that command; else it says where it has moved to
};
[[nodiscard]] const std::vector<CommandWord>& command_words();

/// A program with its arguments.
struct StageCall {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};

/// Finds how a stage, or the name of a command word, is started: drape-<stage> beside the running
/// program.
[[nodiscard]] StageCall call_of(const std::string& command, std::vector<std::string> arguments);

}  // namespace drape

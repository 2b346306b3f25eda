// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"

namespace drape {

/// One stage program to run.
struct Step {
  std::string stage;  ///< for example "simulate"
  std::string what;   ///< for example "A, 31x31, 5 segments"
  std::filesystem::path program;
  std::vector<std::string> arguments;
  std::filesystem::path record;  ///< run record that proves it up to date
  double weight = 1;             ///< share of the stage's time
  /// Files that the step must have written if it ends with a verdict.
  std::vector<std::filesystem::path> outputs = {};
  std::string drape = {};  ///< drape that fails with this step; empty if all drapes need it
  std::string scene = {};  ///< name of the drape, also for its repeats
  bool is_asked = true;    ///< false: not run, but kept if it is up to date
  bool is_extra = false;   ///< true if its failure only makes the result less complete
};

struct StepResult {
  int exit_code = 0;
  std::string output;  ///< text on standard output
  std::string errors;  ///< text on standard error
  std::string fault;   ///< why its exit is invalid for a stage; empty if valid
};

/// Called when a step has ended, before the next one starts.
using StepEnded = std::function<void(std::size_t step, const StepResult& result)>;

/// Called with the fraction (0..1) and text of a running step.
using StepProgress =
    std::function<void(std::size_t step, double fraction, const std::string& what)>;

/// While an instance exists, SIGINT and SIGTERM are recorded instead of ending the process.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] static int signal();  ///< last signal received; 0 if none
};

/// Runs the steps in list order, at most `at_once` at a time. A failed step does not end the
/// others; a signal is passed on to the running ones and ends the list. A step that ends with a
/// verdict but without its outputs, or with an exit code that no stage has, has a fault. Children
/// die with this process, so a killed run leaves no writer behind.
void run_steps(const std::vector<Step>& steps, int at_once, const StepProgress& progress,
               const StepEnded& ended);

/// Error of a program started with --json, from its output, or its fault; nullopt if it has
/// none.
[[nodiscard]] std::optional<Error> error_in(const StepResult& result);

/// Warnings of a program started with --json.
[[nodiscard]] std::vector<std::string> warnings_in(const StepResult& result);

/// Runs a stage's program without showing its output.
[[nodiscard]] StepResult result_of_stage(const std::string& stage,
                                         std::vector<std::string> arguments);

/// Same, but returns its error; nullopt if it succeeded.
[[nodiscard]] std::optional<Error> error_of_stage(const std::string& stage,
                                                  std::vector<std::string> arguments);

/// Replaces this process with the program; throws Error if it cannot be started.
[[noreturn]] void become(const std::filesystem::path& program,
                         const std::vector<std::string>& arguments);

/// A command that is implemented by a stage's program.
struct CommandWord {
  const char* name;          ///< for example "certify"
  const char *stage, *word;  ///< the words of, for example, `drape simulate certify`
  bool typed;                ///< true if `drape NAME` runs it; else its new name is reported
};
[[nodiscard]] const std::vector<CommandWord>& command_words();

/// A program with its arguments.
struct StageCall {
  std::filesystem::path program;
  std::vector<std::string> arguments;
};

/// Program for a stage or command: drape-<stage> beside the running
/// program.
[[nodiscard]] StageCall call_of(const std::string& command, std::vector<std::string> arguments);

}  // namespace drape

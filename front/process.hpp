// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "core/program/steps.hpp"

namespace drape {

/// While an instance exists, SIGINT and SIGTERM are recorded instead of ending the process.
class Interrupts {
 public:
  Interrupts();
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  [[nodiscard]] static int signal();  ///< last signal received; 0 if none
};

/// Error of a program started with --json, from its output, or its fault; nullopt if it has
/// none.
[[nodiscard]] std::optional<Error> error_in(const StepResult& result);

/// Runs a stage's program without showing its output.
[[nodiscard]] StepResult result_of_stage(const std::string& stage,
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "core/program/ending.hpp"

namespace drape {

class Command;
class RunRecord;

/// Options common to all programs.
struct CommonOptions {
  bool json = false;   ///< print the ending as JSON on stdout
  bool quiet = false;  ///< print neither progress nor the ending
  int threads = 0;     ///< number of threads; 0 for all cores; never changes a result
};

/// Adds --json, --quiet, --threads and --version.
void add_common_options(Command& app, CommonOptions& options);

/// Prints the ending to stdout, as text or JSON; returns the exit code (0 GO, 1 NO-GO).
int finish(const Ending& ending, const CommonOptions& options);

/// Stores the ending and the record, then prints the ending; the last call of a step.
int finish(const Ending& ending, const CommonOptions& options, const RunRecord& record);

/// Colours text for a terminal (SGR code, e.g. "31"); plain if `stream` is not a terminal or
/// NO_COLOR is set.
[[nodiscard]] std::string coloured(const std::string& text, const char* code, std::FILE* stream);

/// Prints to standard output; throws Error(internal) if that fails.
void print_text(const std::string& text);

/// Parses, runs, and turns every Error into a message and its exit code. Never throws. SIGINT and
/// SIGTERM end the program with a message and code 130 or 143; files written so far are complete.
int run_program(Command& app, int argc, char** argv, const CommonOptions& options,
                const std::function<int()>& body);

/// One subcommand of a stage's program, with the function that runs it.
struct StageCommand {
  const char* word;
  int (*run)(int argc, char** argv);
  const char* text;  ///< description for the program's --help
};

/// main() of a stage's program: the first argument selects one of `commands`, else `own` runs,
/// whose --help lists them. Each receives all arguments, including its own name.
int run_stage(int argc, char** argv, int (*own)(int, char**),
              const std::vector<StageCommand>& commands);

/// Like run_program(), for a body that has no command line.
int run_guarded(const std::string& name, const CommonOptions& options,
                const std::function<int()>& body);

/// Arguments without the name of the program, for the run record.
[[nodiscard]] std::vector<std::string> arguments_of(int argc, char** argv);

/// Number of worker threads for `--threads` (0: all cores).
[[nodiscard]] int thread_count(const CommonOptions& options);

}  // namespace drape

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

/// Options that every program has.
struct CommonOptions {
  bool json = false;   ///< the ending as JSON on stdout
  bool quiet = false;  ///< no progress line, no ending
  int threads = 0;     ///< 0: all cores; never changes a result
};

/// Adds --json, --quiet, --threads and --version.
void add_common_options(Command& app, CommonOptions& options);

/// Prints the ending to stdout, as text or JSON; returns the exit code (0 GO, 1 NO-GO).
int finish(const Ending& ending, const CommonOptions& options);

/// The same as the last act of a step: the ending and the record are kept before it is printed.
int finish(const Ending& ending, const CommonOptions& options, const RunRecord& record);

/// The text in a terminal's colour (SGR code, e.g. "31"), plain where `stream` is no terminal or
/// the environment has NO_COLOR.
[[nodiscard]] std::string coloured(const std::string& text, const char* code, std::FILE* stream);

/// Prints to standard output; throws Error(internal) when that cannot be written.
void print_text(const std::string& text);

/// Parses, runs, and turns every Error into one message and its exit code. Never throws. SIGINT and
/// SIGTERM end the program with 130 and 143 and a sentence; what is written by then is whole.
int run_program(Command& app, int argc, char** argv, const CommonOptions& options,
                const std::function<int()>& body);

/// One word of a stage's program and the command that it starts.
struct StageCommand {
  const char* word;
  int (*run)(int argc, char** argv);
  const char* text;  ///< for the list in the program's --help
};

/// The main() of a stage's program: the first argument chooses one of `commands`, any other starts
/// the stage's `own` job, whose --help lists them. Each gets all arguments, its word included.
int run_stage(int argc, char** argv, int (*own)(int, char**),
              const std::vector<StageCommand>& commands);

/// Does what run_program() does, around a body that has no command line of its own.
int run_guarded(const std::string& name, const CommonOptions& options,
                const std::function<int()>& body);

/// Arguments without the program's name, for the run record.
[[nodiscard]] std::vector<std::string> arguments_of(int argc, char** argv);

/// Number of worker threads for `--threads` (0: what the machine has).
[[nodiscard]] int thread_count(const CommonOptions& options);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace drape {

class Command;

/// Options that every program has.
struct CommonOptions {
  bool json = false;   ///< the ending as JSON on stdout
  bool quiet = false;  ///< no progress line, no ending
  int threads = 0;     ///< 0: all cores; never changes a result
};

/// Adds --json, --quiet, --threads and --version.
void add_common_options(Command& app, CommonOptions& options);

/// The last lines a person sees (DESIGN: verdict, the few numbers that matter, what was rejected
/// and why, the next command).
struct Ending {
  bool go = true;
  std::string verdict;                                       ///< one sentence
  std::vector<std::pair<std::string, std::string>> numbers;  ///< name, value with unit
  std::vector<std::string> rejected;                         ///< what and why, with counts
  std::string next_command;
};

/// Prints the ending to stdout, as text or JSON; returns the exit code (0 GO, 1 NO-GO).
int finish(const Ending& ending, const CommonOptions& options);

/// Parses, runs, and turns every Error into one message and its exit code. Never throws. The only
/// word --help-man prints the manual page, --help-words what the completion of a shell offers.
int run_program(Command& app, int argc, char** argv, const CommonOptions& options,
                const std::function<int()>& body);

/// Arguments without the program's name, for the run record.
[[nodiscard]] std::vector<std::string> arguments_of(int argc, char** argv);

/// Number of worker threads for `--threads` (0: what the machine has).
[[nodiscard]] int thread_count(const CommonOptions& options);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/program/run_record.hpp"

namespace CLI {
class App;
}

namespace drape {

class Command;

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

/// Prints to standard error, each control or reordering character as `?`; ignores a failure.
void print_message(const std::string& text);

/// Prints "program: error: ..." to standard error, as print_message() does.
void print_error(const Error& error, const std::string& program);

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

/// Command line of a program or of one of its subcommands; its options come from described records.
/// CLI11 is included in command.cpp only, since its header takes a third of a program's compile
/// time. Invalid arguments end in Error(usage), --help in its text; see run_program().
class Command {
 public:
  /// `name` as typed, for example "drape-simulate certify".
  Command(const std::string& description, const std::string& name);

  /// Declares an option for each field of the record, which must outlive parse(). parse() reads the
  /// arguments by the record's description, so ranges and messages are those of files.
  template <class Record>
  void add_record(Record& record) {
    Record shown = record;
    add_walk([&record](Fields& f) { fields(f, record); },
             [&shown](Fields& f) { fields(f, shown); });
  }
  /// Registers a removed option: using it is an error (exit code 2) that names the replacement.
  void moved(const std::string& option, const std::string& replacement);
  Command* add_subcommand(const std::string& name, const std::string& description);
  void require_subcommand(int least, int most);
  /// Lets the options added so far also follow a subcommand. Options of the program added later are
  /// refused with a subcommand.
  void fallthrough();
  void footer(const std::string& text);
  void set_version(const std::string& text);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool parsed() const;
  /// Number of times that an option was given; `name` like "--out".
  [[nodiscard]] std::size_t count(const std::string& name) const;
  /// The subcommand that was given; null if none.
  [[nodiscard]] const Command* chosen() const;

  /// Parses the arguments after those of the name: "drape-simulate certify" consumes the first one.
  /// Returns the exit code to end with (0 after --help or --version, 2 for invalid arguments, text
  /// printed), or -1 to continue.
  [[nodiscard]] int parse(int argc, char** argv);

 private:
  Command(std::shared_ptr<CLI::App> app, std::string name)
      : app_(std::move(app)), name_(std::move(name)) {}
  void add_walk(std::function<void(Fields&)> read, const std::function<void(Fields&)>& show);
  /// Reads the records of the command and of the given subcommand.
  void read_records(std::vector<Error>& faults) const;

  std::shared_ptr<CLI::App> app_;  ///< the parser; of a subcommand, a part of the program's
  std::string name_;
  std::size_t shared_ = 0;  ///< number of leading options that may follow a subcommand
  std::vector<std::unique_ptr<Command>> subcommands_;
  std::vector<std::function<std::vector<Error>()>> records_;
  std::vector<std::pair<std::string, std::string>> moved_;  ///< removed options, replacements
};

/// Runs a command whose options are the record `Arguments`. `body(arguments, common)` or
/// `body(arguments, words, common)`, with the words for a run record, returns the exit code.
/// `moved` lists removed options and their replacements.
template <class Arguments, class Body>
int run_command(int argc, char** argv, const char* name, const char* text, const Body& body,
                const std::vector<std::pair<std::string, std::string>>& moved = {}) {
  Command app(text, name);
  Arguments arguments;
  CommonOptions common;
  app.add_record(arguments);
  add_common_options(app, common);
  for (const auto& [option, replacement] : moved) app.moved(option, replacement);
  return run_program(app, argc, argv, common, [&] {
    if constexpr (std::is_invocable_v<Body, Arguments&, const CommonOptions&>)
      return body(arguments, common);
    else
      return body(arguments, arguments_of(argc, argv), common);
  });
}

}  // namespace drape

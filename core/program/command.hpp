// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "core/program/program.hpp"

namespace drape {

class Fields;

/// A command-line option derived from a field of a record (options.cpp).
struct OptionSpec {
  std::string names;  ///< "--out,-o", or a bare word for a positional argument
  std::string type;   ///< type shown by help; empty for a flag
  std::string now;    ///< default shown by help
  std::string description;
  std::string excludes = {};  ///< option that excludes this one
  bool required = false;
  int least = 1, most = 1;  ///< number of words it takes
  bool one_per_flag = false;
  bool commas = false;  ///< true if commas separate words too
};

/// Command line of a program or of one of its subcommands; its options come from described records.
/// CLI11 is included in command.cpp only, since its header takes a third of a program's compile
/// time. Invalid arguments end in Error(usage), --help in its text; see run_program().
class Command {
 public:
  /// `name` as typed, for example "drape-simulate certify".
  Command(const std::string& description, const std::string& name);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

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
  struct Parser;
  explicit Command(std::unique_ptr<Parser> parser, std::string name);
  void add_walk(std::function<void(Fields&)> read, const std::function<void(Fields&)>& show);
  void add_spec(const OptionSpec& spec,
                const std::function<void(const std::vector<std::string>&)>& take);
  void exclude(const OptionSpec& spec);
  /// Reads the records of the command and of the given subcommand.
  void read_records(std::vector<Error>& faults) const;

  std::unique_ptr<Parser> parser_;
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

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

/// An option as a described record asks for it (options.cpp).
struct OptionSpec {
  std::string names;  ///< "--out,-o", or a bare word for a positional argument
  std::string type;   ///< as help shows it; empty: a flag
  std::string now;    ///< default that help shows
  std::string description;
  std::string excludes = {};  ///< option that cannot stand beside it
  bool required = false;
  int least = 1, most = 1;  ///< words it takes
  bool one_per_flag = false;
  bool commas = false;  ///< commas part words too
};

/// A program's command line, or a subcommand of it: the options are those of described records.
/// CLI11, whose header is a third of what a program takes to compile, stays in command.cpp. Wrong
/// words end in Error(usage) or in the text of --help, see run_program().
class Command {
 public:
  /// `name` as it is typed, e.g. "drape-simulate certify".
  Command(const std::string& description, const std::string& name);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// Declares an option for each field of the record, which must outlive parse(); parse() reads the
  /// words by the record's description, so ranges and messages are those of files.
  template <class Record>
  void add_record(Record& record) {
    Record shown = record;
    add_walk([&record](Fields& f) { fields(f, record); },
             [&shown](Fields& f) { fields(f, shown); });
  }
  /// An option that is gone: whoever gives it is told what replaces it (exit code 2).
  void moved(const std::string& option, const std::string& replacement);
  Command* add_subcommand(const std::string& name, const std::string& description);
  void require_subcommand(int least, int most);
  /// The options added so far may stand behind a subcommand too; those of the program that are
  /// added later are refused beside one.
  void fallthrough();
  void footer(const std::string& text);
  void set_version(const std::string& text);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] bool parsed() const;
  /// Counts how often the option was given; `name` as "--out".
  [[nodiscard]] std::size_t count(const std::string& name) const;
  /// The subcommand that was given; a null pointer without one.
  [[nodiscard]] const Command* chosen() const;

  /// Reads the words behind those of the name: "drape-simulate certify" takes the first one as its
  /// own. An exit code to end with (0 after --help or --version, 2 for a wrong call,
  /// its text is printed), or -1 to go on.
  [[nodiscard]] int parse(int argc, char** argv);

 private:
  struct Parser;
  explicit Command(std::unique_ptr<Parser> parser, std::string name);
  void add_walk(std::function<void(Fields&)> read, const std::function<void(Fields&)>& show);
  void add_spec(const OptionSpec& spec,
                const std::function<void(const std::vector<std::string>&)>& take);
  void exclude(const OptionSpec& spec);
  /// Reads the records of the command and of the subcommand that was given.
  void read_records(std::vector<Error>& faults) const;

  std::unique_ptr<Parser> parser_;
  std::string name_;
  std::size_t shared_ = 0;  ///< options that stand beside a subcommand, the first of all
  std::vector<std::unique_ptr<Command>> subcommands_;
  std::vector<std::function<std::vector<Error>()>> records_;
  std::vector<std::pair<std::string, std::string>> moved_;  ///< options, and their replacements
};

/// Runs a command whose words are the record `Arguments`: `body(arguments, common)`, or
/// `body(arguments, words, common)` with the words for a run record, gives the exit code. `moved`:
/// options that are gone, and their replacements.
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

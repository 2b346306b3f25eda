// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"

namespace drape {

class Fields;

/// One option or positional argument of a Command; every function returns the option itself, so
/// that calls can be chained. Only command.cpp knows CLI11, whose header is a third of what a
/// program takes to compile.
class Option {
 public:
  Option* required();
  /// Shows the variable's present value in --help as the default.
  Option* capture_default_str();
  Option* default_str(const std::string& text);
  Option* delimiter(char separator);
  Option* expected(int least, int most);
  Option* one_per_flag();  ///< each flag of a list takes one word, not all that follow it
  Option* excludes(const Option* other);
  Option* range(double least, double most);
  Option* positive();
  Option* one_of(const std::vector<std::string>& values);

 private:
  friend class Command;
  explicit Option(void* option) : option_(option) {}
  void* option_;  ///< CLI::Option, owned by the command's parser
};

/// An option as a described record asks for it (options.hpp).
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

/// A program's command line, or a subcommand of it. A variable given to an option must outlive
/// parse(). Wrong words end in Error(usage) or in the text of --help, see run_program().
class Command {
 public:
  /// `name` as it is typed, e.g. "drape-simulate certify".
  Command(const std::string& description, const std::string& name);
  ~Command();
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;

  /// `names` as "--out,-o", or a bare word for a positional argument. Defined for the types that
  /// command.cpp lists: numbers, text, paths, and optionals and lists of these.
  template <typename T>
  Option* add_option(const std::string& names, T& variable, const std::string& description);
  Option* add_flag(const std::string& names, bool& variable, const std::string& description);
  /// An option whose words stand for values; its present value is shown as the default.
  template <typename T>
  Option* add_choice(const std::string& names, T& variable,
                     const std::vector<std::pair<std::string, T>>& choices,
                     const std::string& description) {
    std::vector<std::string> words;
    std::string now;
    for (const auto& [word, value] : choices) {
      words.push_back(word);
      if (value == variable) now = word;
    }
    const auto set = [&variable, choices](const std::string& given) {
      for (const auto& [word, value] : choices) {
        if (word == given) variable = value;
      }
    };
    return add_words(names, words, now, set, description);
  }
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
  /// Counts how often the option was given; `name` as in add_option().
  [[nodiscard]] std::size_t count(const std::string& name) const;
  /// The subcommand that was given; a null pointer without one.
  [[nodiscard]] const Command* chosen() const;
  [[nodiscard]] Command* subcommand(const std::string& name) const;

  /// Reads the words behind those of the name: "drape-simulate certify" takes the first one as its
  /// own. An exit code to end with (0 after --help or --version, 2 for a wrong call,
  /// its text is printed), or -1 to go on.
  [[nodiscard]] int parse(int argc, char** argv);

 private:
  struct Parser;
  explicit Command(std::unique_ptr<Parser> parser, std::string name);
  Option* keep(void* option);
  void add_walk(std::function<void(Fields&)> read, const std::function<void(Fields&)>& show);
  void add_spec(const OptionSpec& spec,
                const std::function<void(const std::vector<std::string>&)>& take);
  void exclude(const OptionSpec& spec);
  /// Reads the records of the command and of the subcommand that was given.
  void read_records(std::vector<Error>& faults) const;
  Option* add_words(const std::string& names, const std::vector<std::string>& words,
                    const std::string& now, const std::function<void(const std::string&)>& set,
                    const std::string& description);

  std::unique_ptr<Parser> parser_;
  std::string name_;
  std::size_t shared_ = 0;  ///< options that stand beside a subcommand, the first of all
  std::vector<std::unique_ptr<Option>> options_;
  std::vector<std::unique_ptr<Command>> subcommands_;
  std::vector<std::function<std::vector<Error>()>> records_;
  std::vector<std::pair<std::string, std::string>> moved_;  ///< options, and their replacements
};

}  // namespace drape

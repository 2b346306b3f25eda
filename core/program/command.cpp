// SPDX-License-Identifier: Apache-2.0
#include "core/program/command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "core/error.hpp"
#include "core/program/similar.hpp"

namespace drape {
namespace {

constexpr int kUsage = 2;

/// Options and commands of a program and of its commands.
void add_names(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
    add_names(*command, names);
  }
}

/// For each word that the program does not know the one that replaced it or was likely meant.
void suggest(const CLI::App& app, const std::vector<std::pair<std::string, std::string>>& moved) {
  std::vector<std::string> known;
  add_names(app, known);
  for (const std::string& word : app.remaining(true)) {
    const std::string name = word.substr(0, word.find('='));
    const auto gone = std::find_if(moved.begin(), moved.end(),
                                   [&](const auto& one) { return one.first == name; });
    if (gone != moved.end()) {
      std::fprintf(stderr, "`%s` is gone: %s\n", name.c_str(), gone->second.c_str());
      continue;
    }
    const std::string best = most_similar(name, known);
    if (!best.empty()) std::fprintf(stderr, "did you mean `%s`?\n", best.c_str());
  }
}

using GivenWords = std::vector<std::pair<const CLI::Option*, std::string>>;

/// Adds the words given to the program and to its command.
void add_given(const CLI::App& app, GivenWords& given) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& word : option->results()) given.emplace_back(option, word);
  for (const CLI::App* command : app.get_subcommands()) add_given(*command, given);
}

/// A file that the program reads is never the one that it writes.
void refuse_overwriting(const CLI::App& app) {
  GivenWords given;
  add_given(app, given);
  for (const auto& [out, file] : given) {
    std::error_code absent;
    if (!out->check_lname("out") || !std::filesystem::is_regular_file(file, absent)) continue;
    for (const auto& [other, word] : given)
      if (other != out && std::filesystem::equivalent(file, word, absent))
        throw usage_error("--out would be written over what is read: " + word,
                          "give another file with --out");
  }
}

template <typename T>
struct ValueOf {
  using type = T;
};
template <typename T>
struct ValueOf<std::optional<T>> {
  using type = T;
};
template <typename T>
struct ValueOf<std::vector<T>> {
  using type = T;
};

/// Empty where the word is a number as people write it: finite, and whole ones in tens, where a
/// leading 0 would ask for eights.
template <typename Number>
std::string fault_of_number(const std::string& word) {
  if constexpr (std::is_floating_point_v<Number>) {
    if (!std::isfinite(std::strtod(word.c_str(), nullptr))) return word + " is no finite number";
  } else {
    const std::size_t first = word.find_first_not_of("+-");
    if (first != word.npos && word[first] == '0' && first + 1 < word.size())
      return word + ": write a whole number without a leading 0";
  }
  return "";
}

CLI::Option& option_of(void* option) {
  return *static_cast<CLI::Option*>(option);
}

}  // namespace

Option* Option::required() {
  option_of(option_).required();
  return this;
}

Option* Option::capture_default_str() {
  option_of(option_).capture_default_str();
  return this;
}

Option* Option::default_str(const std::string& text) {
  option_of(option_).default_str(text);
  return this;
}

Option* Option::delimiter(char separator) {
  option_of(option_).delimiter(separator);
  return this;
}

Option* Option::expected(int least, int most) {
  option_of(option_).expected(least, most);
  return this;
}

Option* Option::one_per_flag() {
  option_of(option_).allow_extra_args(false);
  return this;
}

Option* Option::excludes(const Option* other) {
  option_of(option_).excludes(static_cast<CLI::Option*>(other->option_));
  return this;
}

Option* Option::range(double least, double most) {
  CLI::Option& option = option_of(option_);
  if (option.get_type_name().rfind(CLI::detail::type_name<double>(), 0) == 0)
    option.check(CLI::Range(least, most));
  else
    option.check(CLI::Range(static_cast<long>(least), static_cast<long>(most)));
  return this;
}

Option* Option::positive() {
  const auto above_zero = [](std::string& word) {
    return std::strtod(word.c_str(), nullptr) > 0 ? std::string() : word + " is not above 0";
  };
  option_of(option_).check(CLI::Validator(above_zero, "POSITIVE"));
  return this;
}

Option* Option::one_of(const std::vector<std::string>& values) {
  option_of(option_).check(CLI::IsMember(values));
  return this;
}

struct Command::Parser {
  std::unique_ptr<CLI::App> owned;
  CLI::App* app = nullptr;
};

Command::Command(const std::string& description, const std::string& name)
    : parser_(std::make_unique<Parser>()), name_(name) {
  parser_->owned = std::make_unique<CLI::App>(description, name);
  parser_->app = parser_->owned.get();
}

Command::Command(std::unique_ptr<Parser> parser, std::string name)
    : parser_(std::move(parser)), name_(std::move(name)) {}

Command::~Command() = default;

Option* Command::keep(void* option) {
  options_.push_back(std::unique_ptr<Option>(new Option(option)));
  return options_.back().get();
}

template <typename T>
Option* Command::add_option(const std::string& names, T& variable, const std::string& description) {
  CLI::Option* option = parser_->app->add_option(names, variable, description);
  using Value = typename ValueOf<T>::type;
  if constexpr (std::is_arithmetic_v<Value>) option->check(fault_of_number<Value>);
  return keep(option);
}

#define DRAPE_OPTION_OF(type) \
  template Option* Command::add_option(const std::string&, type&, const std::string&) /* NOLINT */
#define DRAPE_OPTIONS_OF(type)          \
  DRAPE_OPTION_OF(type);                \
  DRAPE_OPTION_OF(std::optional<type>); \
  DRAPE_OPTION_OF(std::vector<type>)
DRAPE_OPTIONS_OF(int);
DRAPE_OPTIONS_OF(double);
DRAPE_OPTIONS_OF(std::string);
DRAPE_OPTIONS_OF(std::filesystem::path);
DRAPE_OPTION_OF(long);
DRAPE_OPTION_OF(unsigned long);
#undef DRAPE_OPTIONS_OF
#undef DRAPE_OPTION_OF

Option* Command::add_flag(const std::string& names, bool& variable,
                          const std::string& description) {
  return keep(parser_->app->add_flag(names, variable, description));
}

Option* Command::add_words(const std::string& names, const std::vector<std::string>& words,
                           const std::string& now,
                           const std::function<void(const std::string&)>& set,
                           const std::string& description) {
  CLI::Option* option = parser_->app->add_option_function<std::string>(names, set, description);
  option->check(CLI::IsMember(words));
  if (!now.empty()) option->default_str(now);
  return keep(option);
}

void Command::add_spec(const OptionSpec& spec,
                       const std::function<void(const std::vector<std::string>&)>& take) {
  CLI::App& app = *parser_->app;
  if (spec.type.empty()) {
    app.add_flag_function(
        spec.names, [take](std::int64_t) { take({}); }, spec.description);
    return;
  }
  CLI::Option* option =
      app.add_option_function<std::vector<std::string>>(spec.names, take, spec.description);
  option->type_name(spec.type)->required(spec.required)->expected(spec.least, spec.most);
  if (!spec.now.empty()) option->default_str(spec.now);
  if (spec.one_per_flag) option->allow_extra_args(false);
  if (spec.most == 1) option->multi_option_policy(CLI::MultiOptionPolicy::Throw);
  if (spec.commas) option->delimiter(',');
}

void Command::exclude(const OptionSpec& spec) {
  if (spec.excludes.empty()) return;
  CLI::App& app = *parser_->app;
  app.get_option(spec.names.substr(0, spec.names.find(',')))
      ->excludes(app.get_option(spec.excludes));
}

void Command::read_records(std::vector<Error>& faults) const {
  for (const auto& read : records_)
    for (Error& fault : read()) faults.push_back(std::move(fault));
  if (const Command* command = chosen()) command->read_records(faults);
}

Command* Command::add_subcommand(const std::string& name, const std::string& description) {
  auto parser = std::make_unique<Parser>();
  parser->app = parser_->app->add_subcommand(name, description);
  if (shared_ > 0) parser->app->footer("Also --json, --quiet, --threads N and --version.");
  subcommands_.push_back(std::unique_ptr<Command>(new Command(std::move(parser), name)));
  return subcommands_.back().get();
}

void Command::require_subcommand(int least, int most) {
  parser_->app->require_subcommand(static_cast<std::size_t>(least), static_cast<std::size_t>(most));
}

void Command::fallthrough() {
  parser_->app->fallthrough();
  shared_ = parser_->app->get_options().size();
}

void Command::footer(const std::string& text) {
  parser_->app->footer(text);
}

void Command::set_version(const std::string& text) {
  parser_->app->set_version_flag("--version", text);
}

bool Command::parsed() const {
  return parser_->app->parsed();
}

std::size_t Command::count(const std::string& name) const {
  return parser_->app->count(name);
}

const Command* Command::chosen() const {
  for (const auto& command : subcommands_)
    if (command->parsed()) return command.get();
  return nullptr;
}

Command* Command::subcommand(const std::string& name) const {
  for (const auto& command : subcommands_)
    if (command->name() == name) return command.get();
  return nullptr;
}

void Command::moved(const std::string& option, const std::string& replacement) {
  moved_.emplace_back(option, replacement);
}

int Command::parse(int argc, char** argv) {
  try {
    const auto own = std::count(name_.begin(), name_.end(), ' ');
    parser_->app->parse(argc - static_cast<int>(own), argv + own);
    const auto options = parser_->app->get_options();
    for (std::size_t i = shared_; chosen() != nullptr && i < options.size(); ++i)
      if (options[i]->count() > 0)
        throw usage_error("`" + chosen()->name() + "` takes no " + options[i]->get_name() + " (" +
                              options[i]->results()[0] + ")",
                          "see its --help");
    refuse_overwriting(*parser_->app);
    std::vector<Error> faults;
    read_records(faults);
    throw_if_any(std::move(faults));
    return -1;
  } catch (const CLI::ParseError& error) {
    if (parser_->app->exit(error) == 0) return 0;
    suggest(*parser_->app, moved_);
    return kUsage;
  }
}

}  // namespace drape

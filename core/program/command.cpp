// SPDX-License-Identifier: Apache-2.0
#include "core/program/command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "core/error.hpp"
#include "core/program/similar.hpp"

namespace drape {
namespace {

constexpr int kUsage = 2;

/// Collects the names of the options and commands of a program and its subcommands.
void add_names(const CLI::App& app, std::vector<std::string>& names) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const CLI::App* command : app.get_subcommands({})) {
    names.push_back(command->get_name());
    add_names(*command, names);
  }
}

/// Suggests, for each unknown word, its replacement or the most similar name.
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
    if (!best.empty() && best != name) std::fprintf(stderr, "did you mean `%s`?\n", best.c_str());
  }
}

using GivenWords = std::vector<std::pair<const CLI::Option*, std::string>>;

/// Collects the words given to the program and its subcommand.
void add_given(const CLI::App& app, GivenWords& given) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& word : option->results()) given.emplace_back(option, word);
  for (const CLI::App* command : app.get_subcommands()) add_given(*command, given);
}

/// Throws if an output of the program is also one of its inputs.
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

}  // namespace

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
  // Otherwise it would consume the next argument.
  if (spec.one_per_flag || spec.least == spec.most) option->allow_extra_args(false);
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

void Command::moved(const std::string& option, const std::string& replacement) {
  moved_.emplace_back(option, replacement);
}

int Command::parse(int argc, char** argv) {
  try {
    const auto own = std::count(name_.begin(), name_.end(), ' ');
    parser_->app->parse(argc - static_cast<int>(own), argv + own);
    std::vector<Error> faults;
    read_records(faults);  // first, so that --json applies to the errors below too
    const auto options = parser_->app->get_options();
    for (std::size_t i = shared_; chosen() != nullptr && i < options.size(); ++i)
      if (options[i]->count() > 0)
        throw usage_error("`" + chosen()->name() + "` takes no " + options[i]->get_name() + " (" +
                              options[i]->results()[0] + ")",
                          "see its --help");
    refuse_overwriting(*parser_->app);
    throw_if_any(std::move(faults));
    return -1;
  } catch (const CLI::ParseError& error) {
    if (parser_->app->exit(error) == 0) return 0;
    suggest(*parser_->app, moved_);
    return kUsage;
  }
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "core/program/manual.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "core/program/command.hpp"
#include "core/program/run_record.hpp"

namespace drape {
namespace {

constexpr const char* kExitStatus = R"(.SH EXIT STATUS
.TP
0
good
.TP
1
it ran, and its verdict is NO\-GO
.TP
2
wrong use
.TP
3
bad input
.TP
4
a device failed
.TP
5
internal error
.TP
130
interrupted; what was finished is kept
)";

/// Text in which groff finds no command of its own.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  if (!result.empty() && (result[0] == '.' || result[0] == '\'')) result.insert(0, "\\&");
  return result;
}

std::string paragraphs(const std::string& text) {
  std::istringstream lines(text);
  std::string result;
  bool verbatim = false;
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.starts_with("  ");
    if (!line.empty() && indented != verbatim) {
      if (indented && result.ends_with(".PP\n")) result.resize(result.size() - 4);
      result += indented ? ".PP\n.nf\n" : ".fi\n.PP\n";
      verbatim = indented;
    }
    if (!line.empty()) {
      result += escaped(line) + "\n";
    } else if (!verbatim && !result.empty() && !result.ends_with(".PP\n")) {
      result += ".PP\n";
    }
  }
  if (result.ends_with(".PP\n")) result.resize(result.size() - 4);
  return verbatim ? result + ".fi\n" : result;
}

std::string options(const Command& command) {
  std::string result;
  for (const OptionText& option : command.option_texts()) {
    result += fmt::format(".TP\n\\fB{}\\fR", escaped(option.names));
    if (!option.value.empty()) result += fmt::format(" \\fI{}\\fR", escaped(option.value));
    result += "\n" + escaped(option.text);
    if (option.required) result += " (required)";
    if (!option.usual.empty()) result += fmt::format(" (default: {})", escaped(option.usual));
    result += "\n";
  }
  return result;
}

std::string synopsis(const Command& command) {
  std::string words = "[OPTIONS]";
  for (const OptionText& option : command.option_texts()) {
    if (option.positional)
      words += (option.required ? " " : " [") + option.names + (option.required ? "" : "]");
  }
  return words + (command.subcommands().empty() ? "" : " COMMAND");
}

/// "Drapes a fabric." as "drapes a fabric": what stands beside the name.
std::string summary(const Command& app) {
  std::string text = app.description();
  text.resize(std::min(text.find("\n\n"), text.size()));
  std::replace(text.begin(), text.end(), '\n', ' ');
  text.resize(std::min(text.find(". "), text.size()));
  if (text.starts_with(app.name() + ": ")) text.erase(0, app.name().size() + 2);
  if (text.ends_with(".") || text.ends_with(":")) text.pop_back();
  text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

/// "{rk4,static}" as "rk4 static"; empty when the value is not one of a list.
std::string choices(const std::string& value) {
  if (!value.starts_with("{") || !value.ends_with("}")) return {};
  std::string words = value.substr(1, value.size() - 2);
  std::replace(words.begin(), words.end(), ',', ' ');
  return words;
}

std::string words_of(const Command& command, const std::string& where) {
  std::string own = where + "\t", values;
  for (const OptionText& option : command.option_texts()) {
    std::string names = option.names;
    std::replace(names.begin(), names.end(), ',', ' ');
    if (!option.positional) own += names + " ";
    const std::string words = choices(option.value);
    std::istringstream each(option.positional ? "" : names);
    for (std::string name; !words.empty() && each >> name;) values += name + "\t" + words + "\n";
  }
  for (const auto& subcommand : command.subcommands()) own += subcommand->name() + " ";
  own.back() = '\n';
  return own + values;
}

}  // namespace

std::string manual_page(const Command& app) {
  std::string name = app.name();
  std::replace(name.begin(), name.end(), ' ', '-');
  std::string capitals = name;
  for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::string page = fmt::format(
      ".TH {} 1 {} \"drapebench {}\" \"drapebench manual\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n"
      ".B {}\n{}\n.SH DESCRIPTION\n{}",
      escaped(capitals), DRAPE_RELEASE_DATE, version(), escaped(name), escaped(summary(app)),
      escaped(app.name()), synopsis(app), paragraphs(app.description()));
  const std::string own = options(app);
  if (!own.empty()) page += ".SH OPTIONS\n" + own;
  if (!app.subcommands().empty()) page += ".SH COMMANDS\n";
  for (const auto& subcommand : app.subcommands()) {
    page += fmt::format(".SS {} {}\n{}{}", escaped(subcommand->name()), synopsis(*subcommand),
                        paragraphs(subcommand->description()), options(*subcommand));
  }
  page += kExitStatus;
  return name == "drape" ? page : page + ".SH SEE ALSO\n.BR drape (1)\n";
}

std::string completion_words(const Command& app) {
  std::string words = words_of(app, ".");
  for (const auto& subcommand : app.subcommands())
    words += words_of(*subcommand, subcommand->name());
  return words;
}

}  // namespace drape

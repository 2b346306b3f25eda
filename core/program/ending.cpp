// SPDX-License-Identifier: Apache-2.0
#include "core/program/ending.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace drape {
namespace {

enum class Verdict { go, no_go };

}  // namespace

template <>
inline constexpr std::string_view names_of<Verdict>[] = {"GO", "NO-GO"};

void fields(Fields& f, Ending& ending) {
  auto verdict = ending.go ? Verdict::go : Verdict::no_go;
  f({"verdict", "verdict on the measurement"}, verdict);
  ending.go = verdict == Verdict::go;
  f({"sentence", "reason for the verdict in one sentence"}, ending.verdict);
  // Each key may occur once per object.
  std::map<std::string, int> times;
  for (auto& [name, value] : ending.numbers)
    if (const int before = times[name]++; before > 0) name += fmt::format(" ({})", before + 1);
  f.otherwise({"numbers", "values with units, by name"}, ending.numbers);
  f.otherwise({"rejected", "data that were not used, with the reason"}, ending.rejected);
  f.otherwise({"warnings", "data that were used despite an anomaly"}, ending.warnings);
  f.otherwise({"advice", "steps that would improve the next result"}, ending.advice);
  f.otherwise({"next_command", "command to run next"}, ending.next_command);
  f.if_any({"tables", "text printed before the verdict"}, ending.tables);
}

std::string printed(const Ending& ending) {
  std::string text =
      fmt::format("{}{}: {}\n", ending.tables, ending.go ? "GO" : "NO-GO", ending.verdict);
  std::size_t width = 0;
  for (const auto& number : ending.numbers) width = std::max(width, number.first.size());
  for (const auto& [name, value] : ending.numbers)
    text += fmt::format("  {:<{}}  {}\n", name, width, value);
  for (const std::string& line : ending.rejected) text += fmt::format("  rejected: {}\n", line);
  for (const std::string& line : ending.warnings) text += fmt::format("  warning: {}\n", line);
  for (const std::string& line : ending.advice) text += fmt::format("  advice: {}\n", line);
  if (!ending.next_command.empty()) text += fmt::format("  next: {}\n", ending.next_command);
  return text;
}

std::optional<Ending> ending_in(std::string_view output) {
  const std::size_t line = output.starts_with('{') ? 0 : output.find("\n{") + 1;
  if (line == 0 && !output.starts_with('{')) return std::nullopt;
  try {
    const Value printed = json_value(output.substr(line));
    Value known = Value::Table{};
    const Value all = value_of(Ending{.tables = " "});
    for (const auto& [key, unused] : *all.get_if<Value::Table>())
      if (const Value* value = printed.find(key)) known[key] = *value;
    Ending ending;
    if (!faults_of_reading(Document(Syntax::json, known), walk_through(ending)).empty())
      return std::nullopt;
    return ending;
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::filesystem::path ending_path(const std::filesystem::path& record) {
  std::filesystem::path file = record;
  return file.replace_extension().replace_extension(".ending.json");
}

std::optional<Ending> kept_ending(const std::filesystem::path& record) {
  try {
    const std::filesystem::path file = ending_path(record);
    if (!std::filesystem::is_regular_file(file)) return std::nullopt;
    return read_record<Ending>(file);
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace drape

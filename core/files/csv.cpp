// SPDX-License-Identifier: Apache-2.0
#include "core/files/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <utility>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape {
namespace {

constexpr std::size_t kMostBytesOfCsv = 16 << 20;  ///< a byte may take 50 bytes of memory as cells
constexpr std::size_t kMostColumns = 1000;         ///< limits the memory for a line of commas

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> cells_of(const std::string& line, const Where& where) {
  std::vector<std::string> cells(1);
  bool quoted = false, was_quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (line[i] == '"' && (quoted || trimmed(cells.back()).empty())) {
      quoted = !quoted;
      was_quoted = true;
    } else if (line[i] == ',' && !quoted) {
      if (!was_quoted) cells.back() = trimmed(cells.back());
      was_quoted = false;
      if (cells.size() == kMostColumns)
        throw bad_input(fmt::format("more than {} cells", kMostColumns), where, "remove some");
      cells.emplace_back();
    } else {
      cells.back() += line[i];
    }
  }
  if (quoted) throw bad_input("a quote does not end on its line", where, "close it");
  if (!was_quoted) cells.back() = trimmed(cells.back());
  return cells;
}

double number_of(const std::string& cell, const Where& where) {
  double value = 0;
  const auto [end, failed] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (failed != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
    throw bad_input(fmt::format("`{}` is not a finite number", cell), where,
                    "give a decimal number such as 0.25, without unit");
  return value;
}

}  // namespace

std::size_t CsvText::column(const std::string& name) const {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw bad_input(fmt::format("the column `{}` is missing", name), {.file = file.string()},
                    fmt::format("there are: {}", fmt::join(names, ",")));
  return static_cast<std::size_t>(found - names.begin());
}

bool CsvText::has(const std::string& name) const {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::optional<double> CsvText::number(std::size_t row, const std::string& name) const {
  const std::string& cell = rows.at(row)[column(name)];
  if (cell.empty()) return std::nullopt;
  return number_of(cell, {.file = file.string(), .line = lines[row], .field = name});
}

CsvText read_csv_text(const std::filesystem::path& file) {
  CsvText csv{file, 0, {}, {}, {}};
  std::string text = read_text(file);
  if (text.size() > kMostBytesOfCsv)
    throw bad_input("it is larger than 16 MiB", {.file = file.string()}, "name the right file");
  if (text.find('\0') != std::string::npos)
    throw bad_input("it is no text, or text of two bytes a letter (UTF-16)",
                    {.file = file.string()}, "save it as CSV in UTF-8");
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // byte order mark of spreadsheets
  // Lines end with \n, \r\n, or \r as older spreadsheets write them.
  if (text.find('\n') == std::string::npos) std::replace(text.begin(), text.end(), '\r', '\n');
  std::istringstream stream(std::move(text));
  int number = 1;
  for (std::string line; std::getline(stream, line); ++number) {
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const Where where{.file = file.string(), .line = number};
    std::vector<std::string> cells = cells_of(line, where);
    if (csv.names.empty()) {
      if (cells.size() == 1 && line.find_first_of(";\t") != std::string::npos)
        throw bad_input("semicolons or tabs part its columns", where,
                        "save it with commas between columns and points in numbers");
      csv.names = std::move(cells);
      csv.head_line = number;
      continue;
    }
    if (cells.size() != csv.names.size())
      throw bad_input(fmt::format("{} cells instead of {}", cells.size(), csv.names.size()), where,
                      "give one number per column: commas part columns, points decimals");
    csv.rows.push_back(std::move(cells));
    csv.lines.push_back(number);
  }
  if (csv.names.empty())
    throw bad_input("the file holds no column headers", {.file = file.string()},
                    "the first line names the columns with their units");
  return csv;
}

Csv read_csv(const std::filesystem::path& file, const std::vector<std::string>& names) {
  const CsvText text = read_csv_text(file);
  if (!names.empty() && text.names != names) {
    throw bad_input(fmt::format("the column headers are `{}`", fmt::join(text.names, ",")),
                    {.file = file.string(), .line = text.head_line},
                    fmt::format("the first line must be `{}`: units are part of the names",
                                fmt::join(names, ",")));
  }
  Csv csv{file, text.names, std::vector<std::vector<double>>(text.names.size()), text.lines};
  for (std::size_t row = 0; row < text.rows.size(); ++row)
    for (std::size_t i = 0; i < csv.names.size(); ++i)
      csv.columns[i].push_back(
          number_of(text.rows[row][i],
                    {.file = file.string(), .line = text.lines[row], .field = csv.names[i]}));
  return csv;
}

std::string csv_cell(const std::string& text) {
  std::string cell = text;
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos) {
    const char* begin = text.data() + (text.front() == '+' ? 1 : 0);
    const char* end = text.data() + text.size();
    double number = 0;
    if (std::from_chars(begin, end, number).ptr != end) cell.insert(cell.begin(), '\'');
  }
  if (cell.find_first_of(",\"\n\r") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_text(const std::vector<std::string>& names,
                     const std::vector<std::vector<double>>& columns) {
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  for (std::size_t row = 0; !columns.empty() && row < columns.front().size(); ++row)
    for (std::size_t i = 0; i < columns.size(); ++i)
      text += fmt::format("{}{}", columns[i].at(row), i + 1 < columns.size() ? "," : "\n");
  return text;
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "core/files/csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "core/error.hpp"
#include "core/files/files.hpp"

namespace drape {
namespace {

std::string trimmed(std::string text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(trimmed(cell));
  if (!line.empty() && line.back() == ',') cells.emplace_back();
  return cells;
}

double number_of(const std::string& cell, const Where& where) {
  double value = 0;
  const auto [end, failed] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (failed != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value)) {
    throw bad_input(fmt::format("`{}` is not a finite number", cell), where,
                    "give a decimal number such as 0.25, without unit");
  }
  return value;
}

}  // namespace

Csv read_csv(const std::filesystem::path& file, const std::vector<std::string>& names) {
  Csv csv{file, {}, {}, {}};
  std::istringstream stream(read_text(file));
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string> cells = cells_of(line);
    if (csv.names.empty()) {
      if (cells != names) {
        throw bad_input(fmt::format("the column heads are `{}`", fmt::join(cells, ",")),
                        {.file = file.string(), .line = number},
                        fmt::format("the first line must be `{}`: units are part of the names",
                                    fmt::join(names, ",")));
      }
      csv.names = cells;
      csv.columns.resize(names.size());
      continue;
    }
    if (cells.size() != names.size()) {
      throw bad_input(fmt::format("{} cells instead of {}", cells.size(), names.size()),
                      {.file = file.string(), .line = number}, "give one number per column");
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
      csv.columns[i].push_back(
          number_of(cells[i], {.file = file.string(), .line = number, .field = names[i]}));
    }
    csv.lines.push_back(number);
  }
  if (csv.names.empty()) {
    throw bad_input("the file holds no column heads", {.file = file.string()},
                    fmt::format("the first line must be `{}`", fmt::join(names, ",")));
  }
  return csv;
}

std::string csv_text(const std::vector<std::string>& names,
                     const std::vector<std::vector<double>>& columns) {
  std::string text = fmt::format("{}\n", fmt::join(names, ","));
  const std::size_t rows = columns.empty() ? 0 : columns.front().size();
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      text += fmt::format("{}{}", i == 0 ? "" : ",", columns[i].at(row));
    }
    text += '\n';
  }
  return text;
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace drape {

/// Columns of finite numbers, e.g. one Kawabata curve. `#` starts a comment line.
struct Csv {
  std::filesystem::path file;
  std::vector<std::string> names;            ///< column headers with units
  std::vector<std::vector<double>> columns;  ///< columns[k][row]
  std::vector<int> lines;                    ///< 1-based line of each row
};

/// Reads a CSV; its header must equal `names` if these are given. Throws Error naming file, line
/// and column for a wrong header, a missing or surplus cell, and a value that is not a finite
/// number.
[[nodiscard]] Csv read_csv(const std::filesystem::path& file,
                           const std::vector<std::string>& names = {});

/// CSV of arbitrary text; a cell in double quotes may contain commas and doubled quotes.
struct CsvText {
  std::filesystem::path file;
  int head_line = 0;  ///< 1-based line of the header
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `names`
  std::vector<int> lines;                      ///< 1-based line of each row

  /// Index of a column; throws Error naming the file and the available columns.
  [[nodiscard]] std::size_t column(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const;
  /// Finite number in a cell, nullopt if it is empty; throws Error naming line and column.
  [[nodiscard]] std::optional<double> number(std::size_t row, const std::string& name) const;
};

/// Reads any CSV with a header. Throws Error for rows of different length and an unclosed quote.
[[nodiscard]] CsvText read_csv_text(const std::filesystem::path& file);

/// Formats one cell, quoted if necessary. Text that a spreadsheet would run as a formula (starts
/// with = + - @ and is not a number) gets an apostrophe in front.
[[nodiscard]] std::string csv_cell(const std::string& text);

/// Text of a CSV file; numbers in their shortest exact form.
[[nodiscard]] std::string csv_text(const std::vector<std::string>& names,
                                   const std::vector<std::vector<double>>& columns);

}  // namespace drape

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

/// Reads a CSV whose head must be exactly `names`, where they are given. Throws Error naming file,
/// line and column for a wrong head, a missing or surplus cell, and a value that is not a finite
/// number.
[[nodiscard]] Csv read_csv(const std::filesystem::path& file,
                           const std::vector<std::string>& names = {});

/// Cells of any text; one in double quotes may hold commas and doubled quotes.
struct CsvText {
  std::filesystem::path file;
  int head_line = 0;  ///< 1-based line of the names
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;  ///< each as long as names
  std::vector<int> lines;                      ///< 1-based line of each row

  /// Index of a column; throws Error naming the file and the columns that there are.
  [[nodiscard]] std::size_t column(const std::string& name) const;
  [[nodiscard]] bool has(const std::string& name) const;
  /// Finite number of a cell, nothing when it is empty; throws Error naming line and column.
  [[nodiscard]] std::optional<double> number(std::size_t row, const std::string& name) const;
};

/// Reads any CSV with a head. Throws Error for rows of another length and an open quote.
[[nodiscard]] CsvText read_csv_text(const std::filesystem::path& file);

/// One cell: quoted where it must be. Text that a spreadsheet would run as a formula (= + - @ in
/// front of something that is no number) gets an apostrophe in front.
[[nodiscard]] std::string csv_cell(const std::string& text);

}  // namespace drape

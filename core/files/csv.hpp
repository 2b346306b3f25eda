// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace drape {

/// Columns of finite numbers, e.g. one Kawabata curve. `#` starts a comment line.
struct Csv {
  std::filesystem::path file;
  std::vector<std::string> names;            ///< column heads with units
  std::vector<std::vector<double>> columns;  ///< columns[k][row]
  std::vector<int> lines;                    ///< 1-based line of each row
};

/// Reads a CSV whose head must be exactly `names`. Throws Error naming file, line and column for
/// a wrong head, a missing or surplus cell, and a value that is not a finite number.
[[nodiscard]] Csv read_csv(const std::filesystem::path& file,
                           const std::vector<std::string>& names);

/// The text of a CSV file; numbers in their shortest exact form.
[[nodiscard]] std::string csv_text(const std::vector<std::string>& names,
                                   const std::vector<std::vector<double>>& columns);

}  // namespace drape

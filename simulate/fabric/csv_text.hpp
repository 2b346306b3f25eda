// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

namespace drape::simulate {

/// Text of a CSV file; numbers in their shortest exact form.
[[nodiscard]] inline std::string csv_text(const std::vector<std::string>& names,
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

}  // namespace drape::simulate

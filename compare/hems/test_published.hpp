// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/hems/hem_files.hpp"
#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::compare {

/// The 304 repeats in `tests/data/real-drapes`, without its other observations and notes.
inline HemSet published_hems() {
  const CsvText table = read_csv_text(test::test_data("real-drapes") / "silhouettes.csv");
  const auto wanted = [](const std::string& name) {
    return name == "fabric" || name == "sample" || name == "face" || name == "repeat" ||
           (name.size() == 4 && name.front() == 'r');
  };
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t i = 0; i < cells.size(); ++i)
      if (wanted(table.names[i])) text += (text.empty() ? "" : ",") + csv_cell(cells[i]);
    return text + "\n";
  };
  std::string text = line(table.names);
  for (const auto& row : table.rows)
    if (row[table.column("series")] == "repeat") text += line(row);
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "repeats.csv", text);
  return read_hems({folder.path() / "repeats.csv"}, {});
}

}  // namespace drape::compare

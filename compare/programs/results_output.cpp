// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_output.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

namespace fs = std::filesystem;

namespace {

/// Adds a column with the title of the table, since one file contains several.
Table with_its_title(Table table) {
  if (table.title.empty()) return table;
  table.names.insert(table.names.begin(), "table");
  for (auto& row : table.rows) row.insert(row.begin(), table.title);
  return table;
}

}  // namespace

void write(const ResultsArguments& arguments, const CommonOptions& common,
           const std::vector<const Table*>& tables) {
  // The format of an export takes precedence over the options of all commands.
  const bool json = arguments.format ? arguments.format == ExportFormat::json : common.json;
  const bool csv = !json && (arguments.csv || arguments.format == ExportFormat::csv);
  std::string text;
  Json list = Json::array();
  for (const Table* table : tables) {
    if (csv && !text.empty()) text += '\n';
    if (!json) text += csv ? csv_of(with_its_title(*table)) : text_of(*table) + '\n';
    if (json) list.push_back({{"title", table->title}, {"rows", json_of(*table)}});
  }
  if (json) text = pretty(tables.size() == 1 && tables[0]->title.empty() ? list[0]["rows"] : list);
  if (!arguments.file.empty()) return write_durable(arguments.file, text);
  print_text(json || csv ? text : printable(std::move(text)));
  const bool empty = std::all_of(tables.begin(), tables.end(),
                                 [](const Table* table) { return table->rows.empty(); });
  if (empty && !json && !csv && !common.quiet)
    fmt::print(stderr,
               "nothing in {} matches; `drape results runs` and `list --all` show what is there\n",
               arguments.store);
}

void write_list(const ResultsArguments& arguments, const CommonOptions& common,
                const std::vector<Table>& tables) {
  std::vector<const Table*> list;
  list.reserve(tables.size());
  for (const Table& table : tables) list.push_back(&table);
  write(arguments, common, list);
}

void write(const ResultsArguments& arguments, const CommonOptions& common, const Table& table) {
  write(arguments, common, std::vector<const Table*>{&table});
}

void require_apart_from_store(const fs::path& out, const fs::path& store) {
  const fs::path to = fs::weakly_canonical(out), kept = fs::weakly_canonical(real_store(store));
  bool of_store = false;
  for (const char* end : {"", "-wal", "-shm", ".sig"})
    of_store = of_store || to == kept.string() + end;
  if (of_store)
    throw usage_error(fmt::format("--out {} would replace a part of the store", out.string()),
                      "name another file");
}

}  // namespace drape::compare

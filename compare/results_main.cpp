// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/results.hpp"
#include "core/files.hpp"
#include "core/program.hpp"

namespace {

using drape::compare::Table;

struct Output {
  bool csv = false;
  bool json = false;
  std::string file;

  void write(const std::vector<Table>& tables) const {
    std::string text;
    drape::Json list = drape::Json::array();
    for (const Table& table : tables) {
      if (csv && !text.empty()) text += '\n';
      if (!json) text += csv ? csv_of(table) : text_of(table) + '\n';
      list.push_back({{"title", table.title}, {"rows", json_of(table)}});
    }
    if (json) text = drape::pretty(tables.size() == 1 ? list[0]["rows"] : list);
    if (!file.empty()) return drape::write_durable(file, text);
    fmt::print("{}", text);
  }
};

void add_filters(CLI::App* command, drape::compare::ResultFilter& filter) {
  command->add_option("--scene", filter.scene, "only this scene, e.g. A");
  command->add_option("--fabric", filter.fabric, "only this fabric");
  command->add_option("--grid", filter.grid, "only this grid, e.g. 21 or 21x21");
  command->add_option("--segments", filter.segments, "only this number of segments per curve");
}

}  // namespace

int main(int argc, char** argv) {
  using namespace drape::compare;
  CLI::App app("Answers questions about the results store; never changes it.", "drape-results");
  drape::CommonOptions common;
  drape::add_common_options(app, common);
  std::string store = "results.sqlite", key, format, table = "v_real_vs_virtual", sql;
  Output output;
  ResultFilter filter;
  app.add_option("--store", store, "the store (default: results.sqlite)");
  app.add_flag("--csv", output.csv, "comma-separated values instead of aligned columns");
  app.require_subcommand(1);
  app.fallthrough();
  CLI::App* list = app.add_subcommand("list", "one line per comparison, real against virtual");
  add_filters(list, filter);
  CLI::App* show = app.add_subcommand("show", "metrics, provenance and marks of one comparison");
  show->add_option("KEY", key, "start of the comparison's key, from list")->required();
  CLI::App* tables = app.add_subcommand("tables", "the paper's two tables for each drape");
  add_filters(tables, filter);
  CLI::App* save = app.add_subcommand("export", "a whole table or view as csv, json or sql");
  save->add_option("FORMAT", format, "csv, json or sql")
      ->required()
      ->check(CLI::IsMember({"csv", "json", "sql"}));
  save->add_option("--table", table, "table or view; sql always writes the whole store");
  save->add_option("--out", output.file, "file (default: standard output)");
  CLI::App* query = app.add_subcommand("sql", "one read-only SQL query");
  query->add_option("QUERY", sql, "e.g. \"SELECT * FROM v_table1\"")->required();
  return drape::run_program(app, argc, argv, common, [&] {
    const StoreReader reader(store);
    output.json = common.json;
    if (list->parsed()) {
      output.write({list_results(reader, filter)});
    } else if (show->parsed()) {
      const ShownResult shown = show_result(reader, key);
      output.write({shown.metrics, shown.provenance, shown.marks});
    } else if (tables->parsed()) {
      output.write(paper_tables(reader, filter));
    } else if (query->parsed()) {
      output.write({reader.query(sql)});
    } else if (format == "sql") {
      const std::string dump = dump_sql(reader);
      output.file.empty() ? fmt::print("{}", dump) : drape::write_durable(output.file, dump);
    } else {
      output.csv = format == "csv";
      output.json = format == "json";
      output.write({export_table(reader, table)});
    }
    return 0;
  });
}

// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>

#include "compare/history/merge.hpp"
#include "compare/history/seal.hpp"
#include "compare/report/history.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/sheet_folders.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Tables as text, CSV or JSON, on standard output or into a file.
void write(const ResultsArguments& arguments, const CommonOptions& common,
           const std::vector<Table>& tables) {
  const bool csv = arguments.csv || arguments.format == "csv";
  const bool json = common.json || arguments.format == "json";
  std::string text;
  Json list = Json::array();
  for (const Table& table : tables) {
    if (csv && !text.empty()) text += '\n';
    if (!json) text += csv ? csv_of(table) : text_of(table) + '\n';
    if (json) list.push_back({{"title", table.title}, {"rows", json_of(table)}});
  }
  if (json) text = pretty(tables.size() == 1 ? list[0]["rows"] : list);
  if (!arguments.file.empty()) return write_durable(arguments.file, text);
  fmt::print("{}", text);
}

void add_filters(Command* command, ResultFilter& filter) {
  command->add_option("--scene", filter.scene, "only this scene, e.g. A");
  command->add_option("--fabric", filter.fabric, "only this fabric");
  command->add_option("--grid", filter.grid, "only this grid, e.g. 21 or 21x21");
  command->add_option("--segments", filter.segments, "only this number of segments per curve");
  command->add_option("--rig", filter.rig, "only sheets measured on this rig");
  command->add_option("--model", filter.model, "only this cloth model");
  command->add_option("--simulator", filter.simulator, "only this simulator, e.g. drapebench");
  command->add_option("--since", filter.since, "recorded on this ISO date or later");
  command->add_option("--until", filter.until, "recorded on this ISO date or earlier");
}

void add_out(Command* command, ResultsArguments& arguments) {
  command->add_option("--out", arguments.file, "file (default: standard output)");
}

int import_files(const ResultsArguments& arguments, const CommonOptions& common) {
  const fs::path calibration =
      arguments.calibration.empty() ? calibration_in(arguments.sheets) : arguments.calibration;
  const Session session = read_session(sheets_in(arguments.sheets), calibration);
  Outcome outcome;
  compare_session(session, {}, outcome);
  const ImportCounts counts = import_session(arguments.store, session, outcome);
  seal_store(arguments.store, files_of(session));
  Ending ending;
  ending.verdict =
      fmt::format("{} comparisons added, {} were there already", counts.added, counts.present);
  ending.numbers = {{"store", arguments.store}};
  ending.next_command = "drape results list --store " + arguments.store;
  return finish(ending, common);
}

int merge(const ResultsArguments& arguments, const CommonOptions& common) {
  const MergeCounts counts = merge_stores(arguments.store, arguments.sheets);
  Ending ending;
  ending.verdict = fmt::format("{} entries of the ledger added, {} were there already",
                               counts.added, counts.present);
  ending.numbers = {{"store", arguments.store}};
  ending.next_command = "drape results verify --store " + arguments.store;
  return finish(ending, common);
}

int verify(const ResultsArguments& arguments, const CommonOptions& common) {
  const Verification result = verify_store(arguments.store, !arguments.no_recompute);
  Ending ending;
  ending.go = result.findings.empty();
  ending.verdict =
      ending.go ? "every row and every file is as it was written" : result.findings.front();
  ending.numbers = {
      {"rows and what hangs on them", fmt::format("{} entries of the ledger", result.rows)},
      {"files hashed", std::to_string(result.files)},
      {"comparisons recomputed, same bits", std::to_string(result.comparisons)}};
  ending.rejected = result.findings;
  return finish(ending, common);
}

int why(const StoreReader& reader, const ResultsArguments& arguments, const CommonOptions& common) {
  WhyOptions options = arguments.why;
  if (arguments.mark.size() == 2) options.mark = MarkId{arguments.mark[0], arguments.mark[1]};
  const Explanation result = explain(reader, arguments.key, arguments.metric, options);
  write(arguments, common, {result.number, result.chain});
  return result.complete ? 0 : 1;
}

int trend(const StoreReader& reader, const ResultsArguments& arguments,
          const CommonOptions& common) {
  const Trend result = trend_of(reader, arguments.trend);
  write(arguments, common, {result.table});
  return result.alarms == 0 ? 0 : 1;
}

void history(const StoreReader& reader, const ResultsArguments& arguments) {
  const std::string page = history_page(reader, arguments.trend);
  arguments.file.empty() ? fmt::print("{}", page) : write_durable(arguments.file, page);
}

void export_store(const StoreReader& reader, const ResultsArguments& arguments,
                  const CommonOptions& common) {
  if (arguments.format != "sql")
    return write(arguments, common, {export_table(reader, arguments.table)});
  const std::string dump = dump_sql(reader);
  arguments.file.empty() ? fmt::print("{}", dump) : write_durable(arguments.file, dump);
}

void add_reading(Command& app, ResultsArguments& arguments) {
  add_filters(app.add_subcommand("list", "one line per comparison, real against virtual"),
              arguments.filter);
  Command* show = app.add_subcommand("show", "metrics, provenance and marks of one comparison");
  show->add_option("RUN", arguments.key, "start of the comparison's key, from list")->required();
  Command* tables = app.add_subcommand("tables", "the paper's two tables for each drape");
  add_filters(tables, arguments.filter);
  tables
      ->add_option("--paper", arguments.published,
                   "the paper's twelve tables with its own numbers beside (default file: "
                   "rigs/paper/published.csv)")
      ->expected(0, 1)
      ->default_str("rigs/paper/published.csv");
  Command* diff = app.add_subcommand("diff", "two comparisons side by side");
  diff->add_option("A", arguments.key, "start of a comparison's key")->required();
  diff->add_option("B", arguments.second_key, "start of another's")->required();
  Command* save = app.add_subcommand("export", "a whole table or view as csv, json or sql");
  save->add_option("FORMAT", arguments.format, "csv, json or sql")
      ->required()
      ->one_of({"csv", "json", "sql"});
  save->add_option("--table", arguments.table, "table or view; sql always writes the whole store");
  add_out(save, arguments);
  Command* query = app.add_subcommand("sql", "one read-only SQL query");
  query->add_option("QUERY", arguments.sql, "e.g. \"SELECT * FROM v_table1\"")->required();
}

void add_judging(Command& app, ResultsArguments& arguments) {
  Command* trend = app.add_subcommand(
      "trend", "drift of the calibration residual and of each drape; exit code 1 on an alarm");
  Command* page = app.add_subcommand("history", "the whole store as one HTML page");
  for (Command* command : {trend, page}) {
    command->add_option("--specimen", arguments.trend.specimen,
                        "only this reference drape, SCENE or SCENE/FABRIC");
    command->add_option("--sigmas", arguments.trend.alarm_sigmas, "alarm beyond these (default 3)");
    command->add_option("--least", arguments.trend.least_before,
                        "values needed before one is judged (default 5)");
  }
  add_out(page, arguments);
  Command* why = app.add_subcommand(
      "why",
      "the way from a number back to photographs and curves; exit code 1 where it is broken");
  why->add_option("RUN", arguments.key,
                  "start of the key of a comparison (from list), of a pair of simulations, of a "
                  "sheet (drapemeter, uncertainty) or of a calibration (residuals)")
      ->required();
  why->add_option("METRIC", arguments.metric, "e.g. mean_mm, distance_mm, folds, rms_px")
      ->required();
  why->add_option("--mark", arguments.mark, "ROW,COL: the number of one mark")
      ->delimiter(',')
      ->expected(2);
  why->add_option("--camera", arguments.why.camera,
                  "of a calibration: the residual of this camera");
  Command* verify = app.add_subcommand(
      "verify", "finds every altered byte, row and option; exit code 1 when there is one");
  verify->add_flag("--no-recompute", arguments.no_recompute, "leave out recomputing the distances");
  Command* import = app.add_subcommand("import",
                                       "adds sheets, or every sheet below a folder, as drape run "
                                       "and drape study leave them; again adds "
                                       "nothing");
  import->add_option("SHEET", arguments.sheets, "as for drape-compare, or a folder")->required();
  Command* merge = app.add_subcommand(
      "merge", "adds what other stores hold, e.g. those of a study's parts; again adds nothing");
  merge->add_option("STORE", arguments.sheets, "the other stores")->required();
  import->add_option("--calibration", arguments.calibration, "calibration.json of the sheets");
}

}  // namespace

void add_commands(Command& app, ResultsArguments& arguments) {
  app.add_option("--store", arguments.store, "the store (default: results.sqlite)");
  app.add_flag("--csv", arguments.csv, "comma-separated values instead of aligned columns");
  app.require_subcommand(1, 1);
  app.fallthrough();
  add_reading(app, arguments);
  add_judging(app, arguments);
}

int answer(const Command& app, const ResultsArguments& arguments, const CommonOptions& common) {
  const std::string command = app.chosen()->name();
  if (command == "import") return import_files(arguments, common);
  if (command == "merge") return merge(arguments, common);
  if (command == "verify") return verify(arguments, common);
  const StoreReader reader(arguments.store);
  if (command == "why") return why(reader, arguments, common);
  if (command == "trend") return trend(reader, arguments, common);
  if (command == "history") {
    history(reader, arguments);
  } else if (command == "export") {
    export_store(reader, arguments, common);
  } else if (command == "list") {
    write(arguments, common, {list_results(reader, arguments.filter)});
  } else if (command == "show") {
    const ShownResult shown = show_result(reader, arguments.key);
    write(arguments, common, {shown.metrics, shown.provenance, shown.marks});
  } else if (command == "diff") {
    const Difference found = difference_of(reader, arguments.key, arguments.second_key);
    write(arguments, common, {found.metrics, found.marks});
  } else if (command == "tables" && app.subcommand("tables")->count("--paper") > 0) {
    write(arguments, common,
          published_tables(reader, arguments.published.empty() ? "rigs/paper/published.csv"
                                                               : arguments.published));
  } else if (command == "tables") {
    write(arguments, common, paper_tables(reader, arguments.filter));
  } else {
    write(arguments, common, {reader.query(arguments.sql)});
  }
  return 0;
}

}  // namespace drape::compare

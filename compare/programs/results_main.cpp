// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cctype>
#include <deque>

#include "compare/crate/crate.hpp"
#include "compare/history/verify.hpp"
#include "compare/report/report.hpp"
#include "compare/store/outcome.hpp"
#include "core/program/program.hpp"
#include "core/program/words.hpp"

namespace drape::compare {
enum class ExportFormat { csv, json, sql, ro_crate };
}
template <>
inline constexpr std::string_view drape::names_of<drape::compare::ExportFormat>[] = {
    "csv", "json", "sql", "ro-crate"};

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

/// Arguments of one command of drape-results, except those common to all.
struct ResultsArguments {
  std::string command;
  std::string key, second_key, metric, sql, file;
  std::optional<ExportFormat> format;
  fs::path calibration = {}, signing_key = {}, damaged = {}, lab = {};
  std::string table = "v_real_vs_virtual";
  std::string by;      ///< key of a trend
  bool paper = false;  ///< selects the paper's tables with its own numbers
  std::string published = "rigs/paper/published.csv";  ///< file of those numbers
  std::optional<std::array<int, 2>> mark;              ///< row and column
  std::array<int, 2> runs = {};
  WhyOptions why;
  bool apart = false;  ///< imports without comparing
  bool no_recompute = false;
  std::optional<double> tolerance_m;  ///< for an import; default: of the last run of these drapes
  ResultFilter filter;
  TrendOptions trend;
  std::vector<fs::path> sheets;
  RunLabel label;
};

/// Arguments common to all commands.
struct StoreWords {
  std::string store = "results.sqlite";
  bool csv = false;
};
void fields(Fields& f, StoreWords& words) {
  f.otherwise({"store", "the store"}, words.store);
  f.otherwise({"csv", "comma-separated values instead of aligned columns"}, words.csv);
}

void fields(Fields& f, ResultsArguments& a) {
  const auto of = [&](auto... names) { return ((a.command == names) || ...); };
  const bool lists = of("list", "tables");
  if (of("show", "why"))
    f(Field{"run",
            "start of the key of a comparison (from list); for show also the number of a run; for "
            "why also of a pair of simulations, "
            "of a sheet (drapemeter, uncertainty) or of a calibration (residuals)"}
          .called("RUN"),
      a.key);
  if (of("why")) {
    f(Field{"metric", "e.g. mean_mm, distance_mm, folds, rms_px"}.called("METRIC"), a.metric);
    f({"mark", "ROW,COL: the number of one mark"}, a.mark);
    f.otherwise({"camera", "of a calibration: the residual of this camera"}, a.why.camera);
  }
  if (of("show"))
    f.otherwise(
        Field{"drape", "of a run by number: all that is known of this drape"}.called("DRAPE"),
        a.second_key);
  if (of("marks")) {
    f(Field{"first", "number of a run"}.called("RUN1"), a.runs[0]);
    f(Field{"second", "number of another"}.called("RUN2"), a.runs[1]);
  }
  if (of("diff")) {
    f(Field{"a", "number of a run, or start of a comparison's key"}.called("A"), a.key);
    f(Field{"b", "of another"}.called("B"), a.second_key);
  }
  if (of("export")) {
    auto format = ExportFormat::csv;
    f(Field{"format", "csv, json, sql or ro-crate"}.called("FORMAT"), format);
    a.format = format;
    f.otherwise({"about", "of a crate: lab.toml with title, licence and authors"}, a.lab);
    f.otherwise({"table", "table or view; sql always writes the whole store"}, a.table);
  }
  if (of("sql")) f(Field{"query", "e.g. \"SELECT * FROM v_table1\""}.called("QUERY"), a.sql);
  if (of("rescue")) f(Field{"damaged", "the damaged store"}.called("DAMAGED"), a.damaged);
  if (of("merge")) f(Field{"stores", "the other stores"}.called("STORE"), a.sheets);
  if (of("import")) {
    f(Field{"sheet", "as for drape-compare, or a folder"}.called("SHEET"), a.sheets);
    f.otherwise({"apart", "simulations alone, each by itself: a study; nothing is compared"},
                a.apart);
    f.otherwise({"label", "name of the run in the store"}, a.label.label);
    f.otherwise({"operator", "who ran it"}, a.label.operator_name);
    f.otherwise({"calibration", "calibration.json of the sheets"}, a.calibration);
    f({"tolerance_mm",
       "limit of the match, as of drape-compare (default: that of the store's last run of them)",
       units::mm, above_zero},
      a.tolerance_m);
  }
  if (of("tables")) {
    f.otherwise({"paper", "the paper's twelve tables with its own numbers beside"}, a.paper);
    f.otherwise({"published", "CSV of the paper's numbers"}, a.published);
  }
  if (lists || of("runs")) {
    f.otherwise({"scene", "only this scene, e.g. A"}, a.filter.scene);
    f.otherwise({"rig", "only sheets measured on this rig"}, a.filter.rig);
    f.otherwise({"since", "run on this ISO date or later"}, a.filter.since);
    f.otherwise({"until", "run on this ISO date or earlier"}, a.filter.until);
    f.otherwise({"calibration", "measured with it: the start of its hash, or a part of its name"},
                a.filter.calibration);
  }
  if (lists) {
    f.otherwise({"fabric", "only this fabric"}, a.filter.fabric);
    f.otherwise(Field{"grid", "only this grid, e.g. 21 or 21x21"}.without("spacing_mm"),
                a.filter.grid);
    f({"spacing_mm", "only meshes whose finest has this spacing", units::mm, above_zero},
      a.filter.spacing_m);
    f({"segments", "only this number of segments per curve"}, a.filter.segments);
    f.otherwise({"model", "only this cloth model"}, a.filter.model);
    f.otherwise({"simulator", "only this simulator, e.g. drapebench"}, a.filter.simulator);
    f.otherwise(
        {"all", "also what a later run of the same photographs replaced, renamed or left out"},
        a.filter.outdated);
  }
  if (lists || of("export"))
    f({"run", "only what this run compared, replaced or not"}, a.filter.run);
  if (of("trend", "history")) {
    const bool by = of("trend");
    f.otherwise({"specimen", "only this reference drape, SCENE or SCENE/FABRIC"}, a.trend.specimen);
    const Field sigmas{"sigmas", "alarm beyond these"};
    const Field least{"least", "values needed before one is judged"};
    f.otherwise(by ? sigmas.without("by") : sigmas, a.trend.alarm_sigmas);
    f.otherwise(by ? least.without("by") : least, a.trend.least_before);
    if (by)
      f.otherwise({"by",
                   "the distances of all runs, apart by fabric, friction, label or any other key "
                   "of a scene or fabric file; no alarm"},
                  a.by);
  }
  if (of("verify")) {
    f.otherwise(
        {"key", "Ed25519 public key (PEM): the last manifest must be signed with its private key"},
        a.signing_key);
    f.otherwise({"no_recompute", "leave out computing the distances again"}, a.no_recompute);
  }
  if (of("sign")) f({"key", "Ed25519 private key (PEM)"}, a.signing_key);
  if (of("history", "export"))
    f.otherwise({"out", "file (default: standard output); of a crate: new folder"}, a.file);
}

/// A command with its arguments.
struct Question {
  const Command& command;
  const ResultsArguments& arguments;
  const StoreWords& all;
  const CommonOptions& common;

  [[nodiscard]] bool for_people() const { return !common.json && !all.csv; }
  /// A command that continues work on this store.
  [[nodiscard]] std::string next(const std::string& words) const {
    return fmt::format("drape results {} --store {}", words, shell_word(all.store));
  }
};

/// Adds a column with the title of the table, since one file contains several.
Table with_its_title(Table table) {
  if (table.title.empty()) return table;
  table.names.insert(table.names.begin(), "table");
  for (auto& row : table.rows) row.insert(row.begin(), table.title);
  return table;
}

/// Writes tables as text, CSV or JSON to standard output or into a file; returns the exit code.
int write(const Question& question, const Answer& answer) {
  const auto& [command, arguments, all, common] = question;
  const std::vector<Table>& tables = answer.tables;
  // The format of an export takes precedence over the options of all commands.
  const bool json = arguments.format ? arguments.format == ExportFormat::json : common.json;
  const bool csv = !json && (all.csv || arguments.format == ExportFormat::csv);
  const bool people = !json && !csv;
  std::string text;
  if (people && !answer.sentence.empty()) text = answer.sentence + "\n\n";
  Json list = Json::array();
  for (const Table& table : tables) {
    if (csv && !text.empty()) text += '\n';
    if (!json) text += csv ? csv_of(with_its_title(table)) : text_of(table) + '\n';
    if (json) list.push_back({{"title", table.title}, {"rows", json_of(table)}});
  }
  if (json) text = pretty(tables.size() == 1 && tables[0].title.empty() ? list[0]["rows"] : list);
  if (!arguments.file.empty()) {
    write_durable(arguments.file, text);
    return answer.good ? 0 : 1;
  }
  print_text(people ? printable(std::move(text)) : text);
  if (people && !common.quiet &&
      std::all_of(tables.begin(), tables.end(), [](const Table& one) { return one.rows.empty(); }))
    print_message(fmt::format(
        "nothing in {} matches; `drape results runs` and `list --all` show what is there\n",
        all.store));
  return answer.good ? 0 : 1;
}

int write(const Question& question, Table table) {
  Answer answer;
  answer.tables.push_back(std::move(table));
  return write(question, answer);
}

int write_text(const Question& question, const std::string& text) {
  const std::string& file = question.arguments.file;
  file.empty() ? print_text(text) : write_durable(file, text);
  return 0;
}

/// Throws Error(usage) if the output would overwrite the store or its signature.
void require_apart_from_store(const fs::path& out, const fs::path& store) {
  const fs::path to = fs::weakly_canonical(out), kept = fs::weakly_canonical(real_store(store));
  for (const char* end : {"", "-wal", "-shm", ".sig"})
    if (to == kept.string() + end)
      throw usage_error(fmt::format("--out {} would replace a part of the store", out.string()),
                        "name another file");
}

int import_apart(const Question& question) {
  const ApartCounts counts =
      import_simulations(question.all.store, files_in(question.arguments.sheets).sheets);
  Ending ending{.verdict = fmt::format("{} simulations added, {} were there already", counts.added,
                                       counts.present),
                .numbers = {{"store", question.all.store}},
                .next_command = "drape results merge STORE... --store all.sqlite"};
  if (counts.unfinished > 0)
    ending.warnings.push_back(
        fmt::format("{} sheets without a run record were left out: their runs have not ended",
                    counts.unfinished));
  return finish(ending, question.common);
}

/// Tolerance used by the last run of these drapes.
std::optional<double> tolerance_in(const fs::path& store, const Session& session) {
  if (!fs::is_regular_file(store)) return std::nullopt;
  const StoreReader reader(store);
  for (const DrapeFiles& drape : session.drapes)
    for (const auto& [limit_mm] : reader.rows<double>(
             "SELECT b.limit_value FROM match_basis AS b JOIN run_match AS m ON m.sha256 = "
             "b.match_sha256 JOIN run AS r ON r.sha256 = m.run_sha256 WHERE b.basis = 'tolerance' "
             "AND m.measured_sha256 = ? ORDER BY r.number DESC LIMIT 1",
             {drape.input.measured.sha256}))
      return limit_mm * units::mm;
  return std::nullopt;
}

int import_files(const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  const std::string& store = question.all.store;
  if (arguments.apart) return import_apart(question);
  const GivenFiles given = files_in(arguments.sheets);
  const Session session = read_session(
      given.sheets, arguments.calibration.empty() ? given.calibration : arguments.calibration,
      given.repeats);
  Outcome outcome;
  // Completes a store whose creation was interrupted, which a reader would refuse.
  if (fs::is_regular_file(store)) Store(store).close();
  outcome.not_accepted = reason_in_store(store, session);
  outcome.warnings = session.warnings;
  Options options;
  options.tolerance_m =
      arguments.tolerance_m ? arguments.tolerance_m : tolerance_in(store, session);
  compare_session(session, options, outcome);
  const ImportCounts counts = import_session(store, session, outcome, arguments.label);
  const std::string added =
      fmt::format("{} comparisons added, {} were there already", counts.added, counts.present);
  Ending ending{.go = outcome.go(),
                .verdict = outcome.go() ? added : outcome.sentence(),
                .numbers = {{"store", store}},
                .warnings = outcome.warnings,
                .next_command = question.next(outcome.reports.empty() ? "tables" : "list")};
  if (!ending.go) ending.numbers.emplace_back("comparisons", added);
  return finish(ending, question.common);
}

int rescue(const Question& question) {
  const Rescue result = rescue_store(question.arguments.damaged, question.all.store);
  const bool whole = result.lost.empty();
  Ending ending{
      .go = whole,
      .verdict =
          fmt::format("{} listed rows and blobs rescued, {} lost", result.kept, result.lost.size()),
      .numbers = {{"store", question.all.store}},
      .next_command = whole ? question.next("list") : "import the sheets of what is lost again"};
  for (const std::string& lost : result.lost) ending.rejected.push_back("lost: " + lost);
  return finish(ending, question.common);
}

int merge(const Question& question) {
  const MergeCounts counts = merge_stores(question.all.store, question.arguments.sheets);
  Ending ending{.verdict = fmt::format("{} listed rows and blobs added, {} were there already",
                                       counts.added, counts.present),
                .numbers = {{"store", question.all.store}},
                .next_command = question.next("verify")};
  if (!counts.known_better.empty())
    ending.warnings.push_back(fmt::format(
        "of {} rows another store knows values that this one lacks, the first is {}; keep that "
        "store, or import their sheets with the files beside them into a new one",
        counts.known_better.size(), *counts.known_better.begin()));
  return finish(ending, question.common);
}

int sign(const Question& question) {
  const std::string& store = question.all.store;
  sign_store(store, question.arguments.signing_key);
  return finish({.verdict = "the last manifest is signed",
                 .numbers = {{"signature", signature_path(store).string()}},
                 .next_command = question.next("verify") + " --key PUBLIC.pem"},
                question.common);
}

int verify(const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  Verification result = verify_store(question.all.store, !arguments.no_recompute);
  const bool with_key = !arguments.signing_key.empty();
  if (with_key && !is_signed(question.all.store, result.last_manifest, arguments.signing_key))
    result.findings.emplace_back("the last manifest is not the one that was signed");
  const bool go = result.findings.empty();
  return finish(
      {.go = go,
       .verdict = go ? "every row and blob is as it was written" : result.findings.front(),
       .numbers = {{"manifests", std::to_string(result.manifests)},
                   {"rows and blobs hashed", std::to_string(result.rows)},
                   {"comparisons computed again, same bits", std::to_string(result.comparisons)},
                   {"who could have written all of it again",
                    with_key && go ? "nobody without the private key"
                                   : "anybody who can write the file: only a signature shows that, "
                                     "see drape results sign"}},
       .rejected = result.findings},
      question.common);
}

int why(const StoreReader& reader, const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  WhyOptions options = arguments.why;
  if (arguments.mark) options.mark = MarkId{(*arguments.mark)[0], (*arguments.mark)[1]};
  return write(question, explain(reader, arguments.key, arguments.metric, options));
}

/// Number of a run: only digits, fewer than the least length of a key.
std::optional<int> run_number(const std::string& text) {
  const bool digits =
      !text.empty() && text.size() <= 6 &&
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return digits ? std::optional(std::stoi(text)) : std::nullopt;
}

/// Prints a run as it ended, from report.json beside the store if it belongs to that run, otherwise
/// from the drapes in the store. With the name of a drape, prints everything known about this one.
int show_run(const StoreReader& reader, int run, const Question& question) {
  require_run(reader, run);
  reader.require_as_written({.runs = {run}, .values = true});
  const fs::path file = folder_of(reader.file()) / "report.json";
  const std::string& drape = question.arguments.second_key;
  if (fs::is_regular_file(file) && question.for_people()) {
    const auto report = read_record<RunReport>(file);
    const auto dates = reader.rows<std::string>("SELECT date FROM run WHERE number = ?", {run});
    if (report.run == run && std::get<0>(dates.at(0)) == report.date) {
      std::string text = drape.empty() ? ending_text(report, first_line(report), "") : "";
      for (const ReportedDrape& one : report.drapes)
        if (text.empty() && (one.label == drape || one.name == drape)) text = detail_text(one);
      print_text(printable(text));
      if (!text.empty()) return 0;
    }
  }
  return write(question,
               reader.query("SELECT scene AS drape, measurement, match, mean_dist_mm, "
                            "expanded_uncertainty_mm, fabric, discretisation, segments, comparison "
                            "FROM v_run_drape WHERE run = ?1 AND (?2 = '' OR scene = ?2) ORDER BY "
                            "scene",
                            {run, drape}));
}

int show(const StoreReader& reader, const Question& question) {
  const std::string& key = question.arguments.key;
  if (const auto run = run_number(key)) return show_run(reader, *run, question);
  return write(question, show_result(reader, key));
}

int diff(const StoreReader& reader, const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  const auto first = run_number(arguments.key), second = run_number(arguments.second_key);
  return write(question, first && second
                             ? difference_of_runs(reader, *first, *second)
                             : difference_of(reader, arguments.key, arguments.second_key));
}

int trend(const StoreReader& reader, const Question& question) {
  const auto& [by, options] = std::tie(question.arguments.by, question.arguments.trend);
  if (!by.empty()) return write(question, trend_by(reader, by, options.specimen));
  const Trend result = trend_of(reader, options);
  write(question, result.table);
  return result.alarms == 0 ? 0 : 1;
}

int history(const StoreReader& reader, const Question& question) {
  const HistoryPage page = history_page(reader, question.arguments.trend);
  write_text(question, page.html);
  return page.go ? 0 : 1;
}

int tables(const StoreReader& reader, const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  if (!arguments.paper) return write(question, {{}, paper_tables(reader, arguments.filter)});
  ResultFilter scene_alone;
  scene_alone.scene = arguments.filter.scene;
  if (arguments.filter != scene_alone)
    throw usage_error("of the filters --paper takes --scene alone",
                      "leave the others out, or leave --paper out");
  return write(question,
               {{}, published_tables(reader, arguments.published, arguments.filter.scene)});
}

int export_crate(const StoreReader& reader, const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  if (arguments.file.empty() || arguments.lab.empty())
    throw usage_error("a crate needs --out FOLDER and --about lab.toml",
                      "lab.toml names title, description, license and authors");
  const Crate crate =
      write_crate(reader, arguments.filter.run, read_record<Lab>(arguments.lab), arguments.file);
  const bool go = crate.findings.empty();
  return finish(
      {.go = go,
       .verdict = go ? "the crate holds everything behind its numbers" : crate.findings[0],
       .numbers = {{"files", std::to_string(crate.files)},
                   {"runs of programs", std::to_string(crate.actions)}},
       .rejected = crate.findings,
       .next_command = fmt::format("zip -r crate.zip {}", shell_word(arguments.file))},
      question.common);
}

int export_store(const StoreReader& reader, const Question& question) {
  const ResultsArguments& arguments = question.arguments;
  const ExportFormat format = *arguments.format;
  const bool table = format == ExportFormat::csv || format == ExportFormat::json,
             crate = format == ExportFormat::ro_crate;
  for (const auto& [option, fits] :
       {std::pair{"--table", table}, {"--run", crate}, {"--about", crate}})
    if (question.command.count(option) > 0 && !fits)
      throw usage_error(fmt::format("{} says nothing of export {}", option, name_of(format)),
                        "leave it out; `drape results sql` asks for rows of a table");
  if (const auto altered = altered_rows(reader); !altered.empty())
    throw not_as_written(question.all.store, altered.front());
  if (crate) return export_crate(reader, question);
  return table ? write(question, export_table(reader, arguments.table))
               : write_text(question, dump_sql(reader));
}

int sql(const StoreReader& reader, const Question& question) {
  write(question, reader.query(question.arguments.sql, {}, StoreReader::Author::person));
  if (!question.common.quiet)
    print_message(
        "unchecked: the rows behind this answer were not hashed; `drape results verify` "
        "does\n");
  return 0;
}

/// A command: `change` opens the store itself, `ask` only reads it. Both return the exit code.
struct Word {
  const char *name, *description;
  int (*change)(const Question&);
  int (*ask)(const StoreReader&, const Question&) = nullptr;
};
constexpr Word kCommands[] = {
    {"list", "one line per comparison, real against virtual", nullptr,
     [](const StoreReader& reader, const Question& question) {
       return write(question, list_results(reader, question.arguments.filter));
     }},
    {"runs", "one line per run: date, label, verdicts, basis", nullptr,
     [](const StoreReader& reader, const Question& question) {
       return write(question, list_runs(reader, question.arguments.filter));
     }},
    {"show", "a run as it ended, or metrics, provenance and marks of one comparison", nullptr,
     show},
    {"tables", "the paper's two tables for each drape", nullptr, tables},
    {"diff", "two runs by number, or two comparisons by key, side by side", nullptr, diff},
    {"marks",
     "whether the marks moved between two runs, e.g. by a recalibration; exit code 1 where one "
     "did",
     nullptr,
     [](const StoreReader& reader, const Question& question) {
       const auto& [first, second] = question.arguments.runs;
       return write(question, moved_marks(reader, first, second));
     }},
    {"export",
     "a whole table or view as csv, json or sql; results with all behind them as ro-crate", nullptr,
     export_store},
    {"sql", "one read-only SQL query", nullptr, sql},
    {"trend", "drift of the calibration residual and of each drape; exit code 1 on an alarm",
     nullptr, trend},
    {"history", "the whole store as one HTML page; exit code 1 on an alarm or a NO-GO in it",
     nullptr, history},
    {"why",
     "the trace from a number back to photographs and curves; exit code 1 where it is broken",
     nullptr, why},
    {"verify",
     "finds altered rows, blobs and schema, and numbers that do not come out again; exit code 1 "
     "when there is one",
     verify},
    {"sign", "signs the last manifest, so that whoever writes all of the store again is found",
     sign},
    {"rescue",
     "imports all that is whole in a damaged store into another (--store); exit code 1 when "
     "something is lost",
     rescue},
    {"merge", "imports what other stores hold, every row checked by its hash; again adds nothing",
     merge},
    {"import",
     "adds sheets, or every sheet below a folder, as drape run and drape study leave them; again "
     "adds nothing",
     import_files},
};

int answer(const Command& app, const std::deque<ResultsArguments>& commands, const StoreWords& all,
           const CommonOptions& common) {
  std::size_t chosen = 0;
  while (commands[chosen].command != app.chosen()->name()) ++chosen;
  const Question question{*app.chosen(), commands[chosen], all, common};
  const Word& command = kCommands[chosen];
  if (command.change != nullptr) return command.change(question);
  const StoreReader reader(all.store);
  if (!question.arguments.file.empty())
    require_apart_from_store(question.arguments.file, all.store);
  return command.ask(reader, question);
}

}  // namespace
}  // namespace drape::compare

int main(int argc, char** argv) {
  using namespace drape;
  using namespace drape::compare;
  Command app("Answers questions about the results store, imports into it and verifies it.",
              "drape-results");
  CommonOptions common;
  add_common_options(app, common);
  StoreWords all;
  app.add_record(all);
  app.require_subcommand(1, 1);
  app.fallthrough();
  std::deque<ResultsArguments> commands;
  for (const Word& word : kCommands) {
    commands.emplace_back().command = word.name;
    app.add_subcommand(word.name, word.description)->add_record(commands.back());
  }
  return run_program(app, argc, argv, common, [&] { return answer(app, commands, all, common); });
}

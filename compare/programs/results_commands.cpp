// SPDX-License-Identifier: Apache-2.0
#include "compare/programs/results_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>

#include "compare/history/acceptance.hpp"
#include "compare/history/apart.hpp"
#include "compare/history/marks.hpp"
#include "compare/history/transfer.hpp"
#include "compare/history/verify.hpp"
#include "compare/programs/results_export.hpp"
#include "compare/programs/results_output.hpp"
#include "compare/report/history.hpp"
#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/program/command.hpp"
#include "core/program/shell_word.hpp"
#include "core/run_report.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

int import_apart(const ResultsArguments& arguments, const CommonOptions& common) {
  const ApartCounts counts = import_simulations(arguments.store, sheets_in(arguments.sheets));
  Ending ending;
  ending.verdict =
      fmt::format("{} simulations added, {} were there already", counts.added, counts.present);
  ending.numbers = {{"store", arguments.store}};
  if (counts.unfinished > 0)
    ending.warnings.push_back(
        fmt::format("{} sheets without a run record were left out: their runs have not ended",
                    counts.unfinished));
  ending.next_command = "drape results merge STORE... --store all.sqlite";
  return finish(ending, common);
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

int import_files(const ResultsArguments& arguments, const CommonOptions& common) {
  if (arguments.apart) return import_apart(arguments, common);
  const fs::path calibration =
      arguments.calibration.empty() ? calibration_in(arguments.sheets) : arguments.calibration;
  const Session session =
      read_session(sheets_in(arguments.sheets), calibration, repeats_in(arguments.sheets));
  Outcome outcome;
  // Completes a store whose creation was interrupted, which a reader would refuse.
  if (fs::is_regular_file(arguments.store)) Store(arguments.store).close();
  outcome.not_accepted = reason_in_store(arguments.store, session);
  outcome.warnings = session.warnings;
  Options options;
  options.tolerance_m =
      arguments.tolerance_m ? arguments.tolerance_m : tolerance_in(arguments.store, session);
  compare_session(session, options, outcome);
  const ImportCounts counts = import_session(arguments.store, session, outcome, arguments.label);
  Ending ending;
  ending.go = outcome.go();
  const std::string added =
      fmt::format("{} comparisons added, {} were there already", counts.added, counts.present);
  ending.verdict = ending.go ? added : outcome.sentence();
  ending.numbers = {{"store", arguments.store}};
  if (!ending.go) ending.numbers.emplace_back("comparisons", added);
  ending.warnings = outcome.warnings;
  ending.next_command =
      fmt::format("drape results {} --store {}", outcome.reports.empty() ? "tables" : "list",
                  shell_word(arguments.store));
  return finish(ending, common);
}

int rescue(const ResultsArguments& arguments, const CommonOptions& common) {
  const Rescue result = rescue_store(arguments.damaged, arguments.store);
  Ending ending;
  ending.go = result.lost.empty();
  ending.verdict =
      fmt::format("{} listed rows and blobs rescued, {} lost", result.kept, result.lost.size());
  ending.numbers = {{"store", arguments.store}};
  for (const std::string& lost : result.lost) ending.rejected.push_back("lost: " + lost);
  ending.next_command = ending.go ? "drape results list --store " + shell_word(arguments.store)
                                  : "import the sheets of what is lost again";
  return finish(ending, common);
}

int merge(const ResultsArguments& arguments, const CommonOptions& common) {
  const MergeCounts counts = merge_stores(arguments.store, arguments.sheets);
  Ending ending;
  ending.verdict = fmt::format("{} listed rows and blobs added, {} were there already",
                               counts.added, counts.present);
  ending.numbers = {{"store", arguments.store}};
  if (!counts.known_better.empty())
    ending.warnings.push_back(fmt::format(
        "of {} rows another store knows values that this one lacks, the first is {}; keep that "
        "store, or import their sheets with the files beside them into a new one",
        counts.known_better.size(), *counts.known_better.begin()));
  ending.next_command = "drape results verify --store " + shell_word(arguments.store);
  return finish(ending, common);
}

int sign(const ResultsArguments& arguments, const CommonOptions& common) {
  sign_store(arguments.store, arguments.signing_key);
  Ending ending;
  ending.verdict = "the last manifest is signed";
  ending.numbers = {{"signature", signature_path(arguments.store).string()}};
  ending.next_command =
      fmt::format("drape results verify --store {} --key PUBLIC.pem", shell_word(arguments.store));
  return finish(ending, common);
}

int verify(const ResultsArguments& arguments, const CommonOptions& common) {
  Verification result = verify_store(arguments.store, !arguments.no_recompute);
  const bool with_key = !arguments.signing_key.empty();
  if (with_key && !is_signed(arguments.store, result.last_manifest, arguments.signing_key))
    result.findings.emplace_back("the last manifest is not the one that was signed");
  Ending ending;
  ending.go = result.findings.empty();
  ending.verdict = ending.go ? "every row and blob is as it was written" : result.findings.front();
  ending.numbers = {
      {"manifests", std::to_string(result.manifests)},
      {"rows and blobs hashed", std::to_string(result.rows)},
      {"comparisons computed again, same bits", std::to_string(result.comparisons)},
      {"who could have written all of it again",
       with_key && ending.go ? "nobody without the private key"
                             : "anybody who can write the file: only a signature shows that, see "
                               "drape results sign"}};
  ending.rejected = result.findings;
  return finish(ending, common);
}

int why(const StoreReader& reader, const ResultsArguments& arguments, const CommonOptions& common) {
  WhyOptions options = arguments.why;
  if (arguments.mark) options.mark = MarkId{(*arguments.mark)[0], (*arguments.mark)[1]};
  const Explanation result = explain(reader, arguments.key, arguments.metric, options);
  write(arguments, common, {&result.number, &result.chain});
  return result.complete ? 0 : 1;
}

/// Number of a run: only digits, fewer than the least length of a key.
std::optional<int> run_number(const std::string& text) {
  const bool digits =
      !text.empty() && text.size() <= 6 &&
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
  return digits ? std::optional(std::stoi(text)) : std::nullopt;
}

/// Prints a run as it ended, from report.json beside the store if it belongs to that run, otherwise
/// from the drapes in the store. `drape`: everything known about this one.
void show_run(const StoreReader& reader, int run, const ResultsArguments& arguments,
              const CommonOptions& common) {
  require_run(reader, run);
  reader.require_as_written({.runs = {run}, .values = true});
  const fs::path file = folder_of(reader.file()) / "report.json";
  const std::string& drape = arguments.second_key;
  if (fs::is_regular_file(file) && !common.json && !arguments.csv) {
    const auto report = read_record<RunReport>(file);
    const auto dates = reader.rows<std::string>("SELECT date FROM run WHERE number = ?", {run});
    if (report.run == run && std::get<0>(dates.at(0)) == report.date) {
      if (drape.empty()) return print_text(printable(ending_text(report, first_line(report), "")));
      for (const ReportedDrape& one : report.drapes)
        if (one.label == drape || one.name == drape) return print_text(printable(detail_text(one)));
    }
  }
  write(arguments, common,
        reader.query("SELECT scene AS drape, measurement, match, mean_dist_mm, "
                     "expanded_uncertainty_mm, fabric, discretisation, segments, comparison FROM "
                     "v_run_drape WHERE run = ?1 AND (?2 = '' OR scene = ?2) ORDER BY scene",
                     {run, drape}));
}

void diff(const StoreReader& reader, const ResultsArguments& arguments,
          const CommonOptions& common) {
  const auto first = run_number(arguments.key), second = run_number(arguments.second_key);
  if (first && second) {
    const RunDifference found = difference_of_runs(reader, *first, *second);
    if (!common.json && !arguments.csv) fmt::print("{}\n\n", found.sentence);
    return write(arguments, common, {&found.values, &found.drapes});
  }
  const Difference found = difference_of(reader, arguments.key, arguments.second_key);
  write(arguments, common, {&found.metrics, &found.marks});
}

int marks(const StoreReader& reader, const ResultsArguments& arguments,
          const CommonOptions& common) {
  const MovedMarks found = moved_marks(reader, arguments.runs[0], arguments.runs[1]);
  if (!common.json && !arguments.csv) fmt::print("{}\n\n", found.sentence);
  write(arguments, common, {&found.sets, &found.marks});
  const bool none = std::all_of(found.sets.rows.begin(), found.sets.rows.end(),
                                [](const auto& row) { return row[3] == "0"; });
  return none ? 0 : 1;
}

int trend(const StoreReader& reader, const ResultsArguments& arguments,
          const CommonOptions& common) {
  if (!arguments.by.empty()) {
    write(arguments, common, trend_by(reader, arguments.by, arguments.trend.specimen));
    return 0;
  }
  const Trend result = trend_of(reader, arguments.trend);
  write(arguments, common, result.table);
  return result.alarms == 0 ? 0 : 1;
}

int history(const StoreReader& reader, const ResultsArguments& arguments) {
  const HistoryPage page = history_page(reader, arguments.trend);
  arguments.file.empty() ? print_text(page.html) : write_durable(arguments.file, page.html);
  return page.go ? 0 : 1;
}

std::vector<Table> published(const StoreReader& reader, const ResultsArguments& arguments) {
  ResultFilter scene_alone;
  scene_alone.scene = arguments.filter.scene;
  if (arguments.filter != scene_alone)
    throw usage_error("of the filters --paper takes --scene alone",
                      "leave the others out, or leave --paper out");
  return published_tables(reader, arguments.published, arguments.filter.scene);
}

struct Word {
  std::string_view name;
  const char* description;
};
constexpr std::array<Word, 16> kCommands{{
    {"list", "one line per comparison, real against virtual"},
    {"runs", "one line per run: date, label, verdicts, basis"},
    {"show", "a run as it ended, or metrics, provenance and marks of one comparison"},
    {"tables", "the paper's two tables for each drape"},
    {"diff", "two runs by number, or two comparisons by key, side by side"},
    {"marks",
     "whether the marks moved between two runs, e.g. by a recalibration; exit code 1 where one "
     "did"},
    {"export",
     "a whole table or view as csv, json or sql; results with all behind them as ro-crate"},
    {"sql", "one read-only SQL query"},
    {"trend", "drift of the calibration residual and of each drape; exit code 1 on an alarm"},
    {"history", "the whole store as one HTML page; exit code 1 on an alarm or a NO-GO in it"},
    {"why",
     "the trace from a number back to photographs and curves; exit code 1 where it is broken"},
    {"verify",
     "finds altered rows, blobs and schema, and numbers that do not come out again; exit code 1 "
     "when "
     "there is one"},
    {"sign", "signs the last manifest, so that whoever writes all of the store again is found"},
    {"rescue",
     "imports all that is whole in a damaged store into another (--store); exit code 1 when "
     "something "
     "is lost"},
    {"merge", "imports what other stores hold, every row checked by its hash; again adds nothing"},
    {"import",
     "adds sheets, or every sheet below a folder, as drape run and drape study leave them; again "
     "adds nothing"},
}};

}  // namespace

void fields(Fields& f, CommandWords& words) {
  ResultsArguments& a = words.arguments;
  const auto of = [&](auto... names) { return ((words.command == names) || ...); };
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

void fields(Fields& f, StoreWords& words) {
  f.otherwise({"store", "the store"}, words.store);
  f.otherwise({"csv", "comma-separated values instead of aligned columns"}, words.csv);
}

ResultsWords::ResultsWords(Command& app) {
  app.add_record(all);
  app.require_subcommand(1, 1);
  app.fallthrough();
  for (const Word& word : kCommands) {
    Command* command = app.add_subcommand(std::string(word.name), word.description);
    command->add_record(commands.emplace_back(CommandWords{{}, std::string(word.name)}));
  }
}

ResultsArguments ResultsWords::of(const std::string& command) const {
  const auto one = std::find_if(commands.begin(), commands.end(), [&](const CommandWords& words) {
    return words.command == command;
  });
  ResultsArguments arguments = one->arguments;
  arguments.store = all.store;
  arguments.csv = all.csv;
  return arguments;
}

int answer(const Command& app, const ResultsWords& words, const CommonOptions& common) {
  const std::string command = app.chosen()->name();
  const ResultsArguments arguments = words.of(command);
  if (command == "import") return import_files(arguments, common);
  if (command == "verify") return verify(arguments, common);
  if (command == "merge") return merge(arguments, common);
  if (command == "rescue") return rescue(arguments, common);
  if (command == "sign") return sign(arguments, common);
  const StoreReader reader(arguments.store);
  if (!arguments.file.empty()) require_apart_from_store(arguments.file, arguments.store);
  if (command == "why") return why(reader, arguments, common);
  if (command == "marks") return marks(reader, arguments, common);
  if (command == "trend") return trend(reader, arguments, common);
  if (command == "export") return export_store(*app.chosen(), reader, arguments, common);
  if (command == "history") return history(reader, arguments);
  if (command == "list") {
    write(arguments, common, list_results(reader, arguments.filter));
  } else if (const auto run = run_number(arguments.key); command == "show" && run) {
    show_run(reader, *run, arguments, common);
  } else if (command == "show") {
    const ShownResult shown = show_result(reader, arguments.key);
    write(arguments, common, {&shown.metrics, &shown.provenance, &shown.marks});
  } else if (command == "diff") {
    diff(reader, arguments, common);
  } else if (command == "runs") {
    write(arguments, common, list_runs(reader, arguments.filter));
  } else if (command == "tables" && arguments.paper) {
    write_list(arguments, common, published(reader, arguments));
  } else if (command == "tables") {
    write_list(arguments, common, paper_tables(reader, arguments.filter));
  } else {
    write(arguments, common, reader.answer(arguments.sql));
    if (!common.quiet)
      fmt::print(stderr,
                 "unchecked: the rows behind this answer were not hashed; `drape results "
                 "verify` does\n");
  }
  return 0;
}

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#include "compare/store/runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <set>
#include <tuple>

#include "compare/store/writer.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "core/error.hpp"
#include "core/fields/document.hpp"
#include "core/files/files.hpp"
#include "core/program/dates.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

/// Records that the run is current for its photographs again, after another that was stored since.
void repeat_run(Writer& writer, const StoredRun& run, const std::string& content,
                const std::string& date) {
  const auto last =
      writer.value<int>("SELECT last_run FROM v_run_last WHERE run = ?", {run.number});
  if (!last || *last == run.number) return;
  const auto before =
      writer.value<int>("SELECT count(*) FROM run_repetition WHERE run_sha256 = ?", {content});
  writer.insert("run_repetition", repetition_key(content, date, *before), content, date);
}

/// Adds the values of a TOML file; `stand_ins` marks the keys listed as stand-ins.
void add_file(const std::string& owner, const fs::path& file, std::vector<RunValue>& values) {
  if (!fs::is_regular_file(file)) return;
  const Document document = Document::read(file);
  std::vector<std::string> stand_ins;
  if (const Value* list = document.root().find("stand_ins"))
    for (const Value& what :
         list->get_if<Value::List>() ? *list->get_if<Value::List>() : Value::List{})
      if (const auto* text = what.get_if<std::string>()) stand_ins.push_back(*text);
  for (const auto& [key, value] : flat(document.root())) {
    if (key == "schema") continue;
    const bool stand_in = std::any_of(
        stand_ins.begin(), stand_ins.end(),
        [&, &name = key](const std::string& what) { return stands_in_for(what, name); });
    std::string text = value;
    // The name of a curve does not change with its points, so its hash is shown.
    if (const fs::path curve = document.beside(value);
        value.ends_with(".csv") && fs::is_regular_file(curve))
      text += " " + sha256_of_file(curve).substr(0, 12);
    values.push_back({owner, key, text, stand_in});
  }
  // A list can name one thing twice; a run has one row of each.
  for (const std::string& what : std::set<std::string>(stand_ins.begin(), stand_ins.end()))
    if (what.find("hysteresis") != std::string::npos)
      values.push_back({owner, "stand_ins: " + what, "as in the curves", true});
}

/// Hash of the photographs of one set, equal if the same pictures were measured.
std::optional<std::string> pictures_of(const DrapeFiles& drape) {
  if (!drape.detections) return std::nullopt;
  const std::string& set = std::get<MeasuredSource>(drape.input.measured.sheet.source).set;
  std::set<std::string> hashes;
  for (const FrameDetections& frame : drape.detections->frames)
    if (frame.set == set) hashes.insert(frame.camera + " " + frame.image_sha256);
  std::string all;
  for (const std::string& hash : hashes) all += hash + "\n";
  return sha256_of(std::string_view(all));
}

std::optional<std::string> given(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

/// Identifies the calibration independently of its path, since paths differ between machines.
std::optional<std::string> calibration_name(const Session& session) {
  if (!session.calibration) return std::nullopt;
  const Calibration& own = *session.calibration;
  return fmt::format("{}, {}, {} sets", own.rig, own.method, own.sets.size());
}

std::string key_of(const DrapeInput& input, const RealVirtual& row) {
  return comparison_key({input.measured.sha256, input.simulations[row.simulation].sheet.sha256});
}

/// Hash of what distinguishes runs: everything except number, date and warnings, since an import of
/// the same sheets knows fewer of them.
std::string content_of(const Session& session, const Outcome& outcome, const RunLabel& label,
                       const std::vector<RunValue>& values) {
  std::string text = fmt::format("drapebench/run-content/1\n{}\n{}\n{}\n{}\n", label.label,
                                 label.operator_name, version(), session.calibration_sha256);
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    const DrapeInput& input = session.drapes[i].input;
    text += fmt::format("{}\n{}\n{}\n{}\n", report.name, input.measured.sha256,
                        report.go() ? "GO" : report.no_go.front(), report.match.reason);
    for (const RealVirtual& row : report.real_virtual) text += key_of(input, row) + "\n";
    for (const SheetFile& repeat : input.repeats) text += "repeat " + repeat.sha256 + "\n";
  }
  for (const RunValue& value : values)
    if (value.key != "warning")
      text += fmt::format("{}\t{}\t{}\t{}\n", value.owner, value.key, value.value, value.stand_in);
  return sha256_of(std::string_view(text));
}

using Warnings = std::set<std::string>;

/// Key of a run with the same content as an earlier one, but more warnings.
std::string warned_content(const std::string& content, const Warnings& warnings) {
  std::string text = content + "\n";
  for (const std::string& warning : warnings) text += warning + "\n";
  return sha256_of(std::string_view(text));
}

/// The last run with this content that has all of these warnings, so that no warning is lost;
/// otherwise the key of a new one.
std::string key_of_run(Writer& writer, const std::string& content, const Session& session,
                       const Outcome& outcome) {
  if (!writer.has("run", content)) return content;
  const Warnings own(outcome.warnings.begin(), outcome.warnings.end());
  for (const std::string& run :
       writer.texts("SELECT r.sha256 FROM run AS r JOIN run_drape AS d ON d.run = r.number WHERE "
                    "d.measured_sha256 = ? ORDER BY r.number DESC",
                    {session.drapes.front().input.measured.sha256})) {
    Warnings all;
    for (std::string& warning : writer.texts(
             "SELECT value FROM run_value WHERE run = (SELECT number FROM run WHERE sha256 = ?) "
             "AND key = 'warning'",
             {run}))
      all.insert(std::move(warning));
    const bool same = run == content || run == warned_content(content, all);
    if (same && std::includes(all.begin(), all.end(), own.begin(), own.end())) return run;
  }
  return warned_content(content, own);
}

void insert_drape(Writer& writer, int run, const DrapeFiles& drape, const Report& report) {
  const DrapeInput& input = drape.input;
  const auto& source = std::get<MeasuredSource>(input.measured.sheet.source);
  Cell headline, expanded_mm, complete, limit_mm;
  if (report.match.limit_m) limit_mm = *report.match.limit_m / mm;
  if (report.headline) headline = key_of(input, report.real_virtual[*report.headline]);
  if (report.budget) {
    expanded_mm = report.budget->expanded_m / mm;
    complete = report.budget->missing.empty();
  }
  const bool is_new = writer.insert(
      "run_drape", run, input.measured.sha256, report.name, source.set, pictures_of(drape),
      report.go() ? "GO" : "NO-GO", report.go() ? Cell() : Cell(report.no_go.front()),
      name_of(report.match.match), report.match.reason, headline, expanded_mm, complete, limit_mm);
  if (!is_new) throw internal_error("a run has the drape " + report.name + " twice");
  const auto add = [&](const RealVirtual& row) {
    if (const auto id =
            writer.value<int>("SELECT id FROM comparison WHERE sha256 = ?", {key_of(input, row)}))
      writer.insert("run_comparison", *id, run);
  };
  for (const RealVirtual& row : report.real_virtual) add(row);
  for (const BranchSet& set : report.branch_sets)
    for (const BranchComparison& one : set.branches) add(one.as_placed);
}

void insert_match(Writer& writer, const std::string& run, const DrapeInput& input,
                  const Report& report) {
  const std::string key = sha256_of(std::string_view(
      fmt::format("drapebench/run-match/1\n{}\n{}\n", run, input.measured.sha256)));
  int repeats = 1;
  for (const RepeatLine& line : report.repeats) repeats += line.input && line.left_out.empty();
  std::optional<double> p;
  if (report.among_repeats) p = report.among_repeats->matches.front().p;
  writer.insert("run_match", key, run, input.measured.sha256, report.match.rests_on,
                report.significance, repeats, p);
  for (const MatchBasis& basis : report.match.bases)
    writer.insert("match_basis", key, basis.what, name_of(basis.verdict), basis.value, basis.limit,
                  basis.unit, basis.p, basis.reason);
  for (const RepeatLine& line : report.repeats) {
    const SheetFile& sheet = line.input ? input.repeats[*line.input] : input.measured;
    writer.insert("real_repeat", key, sheet.sha256, line.set, line.repeat, given(line.face),
                  given(line.left_out), in_mm(line.from_own_m));
  }
}

}  // namespace

std::string repetition_key(const std::string& run_sha256, const std::string& date, int before) {
  return sha256_of(std::string_view(
      fmt::format("drapebench/run-repetition/1\n{}\n{}\n{}\n", run_sha256, date, before)));
}

bool stands_in_for(const std::string& what, const std::string& key) {
  const auto says = [&](const char* word) { return what.find(word) != std::string::npos; };
  if (what == "all") return key != "name";
  if (says("hysteresis")) return false;
  const bool bias = says("bias") || says("at 45") || says("twist");
  if (key.find(".bias") != std::string::npos) return bias;
  if (key.starts_with("areal_density")) return says("areal density") || says("areal_density");
  return !bias && what.starts_with(key.substr(0, key.find('.')));
}

std::string date_of_run() {
  constexpr std::int64_t kEndOf9999 = 253402300799;  // dates are compared as texts of equal length
  std::int64_t time = std::time(nullptr);
  if (const char* fixed = std::getenv("SOURCE_DATE_EPOCH")) {
    const char* end = fixed + std::strlen(fixed);
    const auto [last, error] = std::from_chars(fixed, end, time);
    if (error != std::errc() || last != end || time < 0 || time > kEndOf9999)
      throw usage_error(fmt::format("SOURCE_DATE_EPOCH is `{}` in the environment", fixed),
                        "give seconds since 1970 up to the year 9999, or unset it");
  }
  return utc_text(std::chrono::system_clock::from_time_t(static_cast<std::time_t>(time)));
}

std::vector<RunValue> values_of(const Session& session, const Outcome& outcome) {
  std::vector<RunValue> values;
  std::set<fs::path> fabrics;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const DrapeFiles& drape = session.drapes[i];
    std::set<std::string> runs;
    for (const Simulation& simulation : drape.input.simulations)
      if (!simulation.branch) runs.insert(simulation.run_label());
    std::string list;
    for (const std::string& run : runs) list += (list.empty() ? "" : "; ") + run;
    values.push_back({"simulations", outcome.reports[i].name, list, false});
    if (const auto& headline = outcome.reports[i].headline) {
      const RealVirtual& row = outcome.reports[i].real_virtual[*headline];
      const auto& levels = drape.input.simulations[row.simulation].levels;
      if (levels && levels->left_m)
        values.push_back({"mesh_error_mm", outcome.reports[i].name,
                          fmt::format("{:.4f}", *levels->left_m / mm), false});
    }
    if (!drape.input.scene) continue;
    add_file("scene " + outcome.reports[i].name, drape.input.scene->file, values);
    const fs::path& fabric = drape.input.scene->fabric_file;
    if (fabrics.insert(fabric).second) add_file("fabric " + fabric.stem().string(), fabric, values);
  }
  for (std::size_t i = 0; i < outcome.warnings.size(); ++i)
    values.push_back({fmt::format("warning {:02}", i + 1), "warning", outcome.warnings[i], false});
  if (session.calibration) {
    values.push_back({"calibration", "method", session.calibration->method, false});
    values.push_back(
        {"calibration", "sets", std::to_string(session.calibration->sets.size()), false});
    values.push_back(
        {"calibration", "cameras", std::to_string(session.calibration->cameras.size()), false});
  }
  std::sort(values.begin(), values.end(), [](const RunValue& a, const RunValue& b) {
    return std::tie(a.owner, a.key) < std::tie(b.owner, b.key);
  });
  return values;
}

StoredRun add_run(Store& store, const Session& session, const Outcome& outcome,
                  const RunLabel& label, const std::string& date) {
  const std::vector<RunValue> values = values_of(session, outcome);
  StoredRun run;
  store.write([&](Writer& writer) {
    const std::string content =
        key_of_run(writer, content_of(session, outcome, label, values), session, outcome);
    if (const auto known =
            writer.value<int>("SELECT number FROM run WHERE sha256 = ?", {content})) {
      run = {*known,
             *writer.value<std::string>("SELECT date FROM run WHERE sha256 = ?", {content})};
      repeat_run(writer, run, content, date);
      return;
    }
    run.date = date;
    Cell rig, recording, recording_name;
    for (const DrapeFiles& drape : session.drapes) {
      rig = std::get<MeasuredSource>(drape.input.measured.sheet.source).rig;
      if (!drape.recording) continue;
      recording = drape.recording->sha256;
      recording_name = drape.recording->name;
    }
    const std::vector<std::string> reasons = outcome.reasons();
    writer.insert("run", std::nullopt, content, run.date, given(label.label),
                  given(label.operator_name), version(), rig, recording, recording_name,
                  given(session.calibration_sha256), calibration_name(session),
                  outcome.go() ? "GO" : "NO-GO", reasons.empty() ? Cell() : Cell(reasons.front()));
    run.number = writer.last_id();
    for (std::size_t i = 0; i < outcome.reports.size(); ++i)
      insert_drape(writer, run.number, session.drapes[i], outcome.reports[i]);
    for (const RunValue& value : values)
      writer.insert("run_value", run.number, value.owner, value.key, value.value, value.stand_in);
    for (std::size_t i = 0; i < outcome.reports.size(); ++i)
      insert_match(writer, content, session.drapes[i].input, outcome.reports[i]);
  });
  return run;
}

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#include "compare/history/acceptance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <variant>

#include "compare/store/writer.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

RigAcceptance read_acceptance(const std::filesystem::path& file) {
  const JsonNode root = JsonNode::open(file, "acceptance", 1);
  RigAcceptance acceptance;
  acceptance.sha256 = sha256_of_file(file);
  acceptance.rig = root.text("rig");
  acceptance.calibration_sha256 = root.text("calibration_sha256");
  acceptance.date = root.optional_text("date");
  acceptance.valid_until = root.optional_text("valid_until");
  acceptance.cause = root.optional_text("cause");
  acceptance.positions = root.integer("positions");
  acceptance.go = root.boolean("go");
  if (root.has("warnings")) acceptance.warnings = root.texts("warnings");
  for (const JsonNode& row : root.items("figures"))
    acceptance.figures.push_back({row.text("name"), row.text("unit"), row.text("where"),
                                  row.optional_number("value"),
                                  row.optional_number("expanded_uncertainty"),
                                  row.optional_number("limit"), row.boolean("go")});
  return acceptance;
}

namespace {

/// The calibrations that the session rests on.
std::set<std::string> calibrations_of(const Session& session) {
  std::set<std::string> calibrations;
  if (!session.calibration_sha256.empty()) calibrations.insert(session.calibration_sha256);
  for (const DrapeFiles& drape : session.drapes)
    calibrations.insert(
        std::get<MeasuredSource>(drape.input.measured.sheet.source).calibration_sha256);
  return calibrations;
}

std::string reason_of(const std::string& cause) {
  return "the acceptance of this calibration is NO-GO: " +
         (cause.empty() ? "a figure is beyond its limit or was not measured" : cause);
}

}  // namespace

std::map<std::string, std::string> reason_in_store(const std::filesystem::path& store,
                                                   const Session& session,
                                                   const std::optional<RigAcceptance>& given) {
  std::map<std::string, std::string> reasons;
  std::optional<StoreReader> reader;
  if (std::filesystem::is_regular_file(store)) reader.emplace(store);
  for (const std::string& calibration : calibrations_of(session)) {
    const bool of_given = given && given->calibration_sha256 == calibration;
    if (of_given && !given->go) reasons[calibration] = reason_of(given->cause.value_or(""));
    if (!reader) continue;
    const auto last = reader->rows<std::string, std::string, std::string>(
        "SELECT a.verdict, a.cause, a.date FROM acceptance AS a JOIN ledger AS l ON l.kind = "
        "'acceptance' AND l.key = a.sha256 WHERE a.calibration_sha256 = ? ORDER BY a.date DESC, "
        "l.sequence DESC LIMIT 1",
        {calibration});
    if (last.empty()) continue;
    const auto& [verdict, cause, date] = last.front();
    if (of_given && date <= given->date.value_or("")) continue;
    reasons.erase(calibration);
    if (verdict != "GO") reasons[calibration] = reason_of(cause);
  }
  return reasons;
}

std::vector<std::string> doubts_of(const RigAcceptance& acceptance, const Session& session) {
  std::vector<std::string> doubts;
  const std::string again = ": record the target again and run drape calib accept";
  std::optional<std::string> day;
  for (const DrapeFiles& drape : session.drapes) {
    if (drape.recording && drape.recording->recorded_on)
      day = std::max(day.value_or(""), *drape.recording->recorded_on);
  }
  for (const std::string& calibration : calibrations_of(session)) {
    if (calibration == acceptance.calibration_sha256) continue;
    doubts.push_back("the last acceptance is of another calibration, older than this one" + again);
    break;
  }
  if (day && acceptance.valid_until && *day > *acceptance.valid_until)
    doubts.push_back(
        fmt::format("the last acceptance expired on {}, the drapes were recorded on {}{}",
                    *acceptance.valid_until, *day, again));
  return doubts;
}

std::optional<RigAcceptance> look_at_acceptance(const std::filesystem::path& file,
                                                const Session& session, Outcome& outcome,
                                                RunRecord& record) {
  std::optional<RigAcceptance> acceptance;
  if (!file.empty()) {
    acceptance = read_acceptance(file);
    record.input(file, acceptance->sha256);
    for (const std::string& warning : acceptance->warnings)
      outcome.warnings.push_back("the acceptance: " + warning);
    for (std::string& doubt : doubts_of(*acceptance, session))
      outcome.warnings.push_back(std::move(doubt));
  }
  outcome.not_accepted = reason_in_store(outcome.store, session, acceptance);
  return acceptance;
}

void store_acceptance(const std::filesystem::path& store, const RigAcceptance& acceptance) {
  Store results(store);
  results.write([&](Writer& writer) {
    writer.insert_unit("rig", acceptance.rig);
    if (!writer.insert("acceptance", acceptance.sha256, acceptance.rig,
                       acceptance.calibration_sha256, acceptance.date, acceptance.valid_until,
                       acceptance.positions, acceptance.go ? "GO" : "NO-GO", acceptance.cause))
      return;
    for (const RigAcceptance::Figure& figure : acceptance.figures)
      writer.insert("acceptance_figure", acceptance.sha256, figure.name, figure.unit, figure.value,
                    figure.expanded, figure.limit, figure.where, figure.go ? "GO" : "NO-GO");
    writer.enter("acceptance", acceptance.sha256);
  });
  results.close();
}

}  // namespace drape::compare

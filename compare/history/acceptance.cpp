// SPDX-License-Identifier: Apache-2.0
#include "compare/history/acceptance.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <variant>

#include "compare/store/writer.hpp"
#include "core/files/files.hpp"

namespace drape::compare {

namespace {

/// The calibrations on which the session is based.
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
                                                   const std::optional<AcceptanceFile>& given) {
  std::map<std::string, std::string> reasons;
  std::optional<StoreReader> reader;
  if (std::filesystem::is_regular_file(store)) reader.emplace(store);
  for (const std::string& calibration : calibrations_of(session)) {
    const bool of_given = given && given->calibration_sha256 == calibration;
    if (of_given && !given->go) reasons[calibration] = reason_of(given->cause.value_or(""));
    if (!reader) continue;
    const auto last = reader->rows<std::string, std::string, std::string>(
        "SELECT a.verdict, a.cause, a.date FROM acceptance AS a JOIN listed AS l ON l.kind = "
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

std::vector<std::string> doubts_of(const AcceptanceFile& acceptance, const Session& session) {
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

std::optional<AcceptanceFile> look_at_acceptance(const std::filesystem::path& file,
                                                 const Session& session, Outcome& outcome,
                                                 RunRecord& record) {
  std::optional<AcceptanceFile> acceptance;
  if (!file.empty()) {
    acceptance = read_record<AcceptanceFile>(file);
    record.input(file, acceptance->document.sha256());
    for (const std::string& warning : acceptance->warnings)
      outcome.warnings.push_back("the acceptance: " + warning);
    for (std::string& doubt : doubts_of(*acceptance, session))
      outcome.warnings.push_back(std::move(doubt));
  }
  outcome.not_accepted = reason_in_store(outcome.store, session, acceptance);
  return acceptance;
}

void store_acceptance(const std::filesystem::path& store, const AcceptanceFile& acceptance) {
  Store results(store);
  const std::string& key = acceptance.document.sha256();
  results.write([&](Writer& writer) {
    writer.insert("rig", acceptance.rig);
    if (!writer.insert("acceptance", key, acceptance.rig, acceptance.calibration_sha256,
                       acceptance.date, acceptance.valid_until, acceptance.positions,
                       acceptance.go ? "GO" : "NO-GO", acceptance.cause))
      return;
    for (const AcceptanceRow& figure : acceptance.figures)
      writer.insert("acceptance_figure", key, figure.name, figure.unit, figure.value,
                    figure.expanded, figure.limit, figure.where, figure.go ? "GO" : "NO-GO");
  });
  results.close();
}

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#include "compare/history/acceptance.hpp"

#include <fmt/format.h>

#include <algorithm>
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
  for (const JsonNode& row : root.items("figures"))
    acceptance.figures.push_back({row.text("name"), row.text("unit"), row.text("where"),
                                  row.optional_number("value"),
                                  row.optional_number("expanded_uncertainty"),
                                  row.optional_number("limit"), row.boolean("go")});
  return acceptance;
}

namespace {

/// Of the calibration that the marks were measured with; empty where there is none.
std::string calibration_of(const Session& session) {
  if (!session.calibration_sha256.empty() || session.drapes.empty())
    return session.calibration_sha256;
  const Sheet& first = session.drapes.front().input.measured.sheet;
  return std::get<MeasuredSource>(first.source).calibration_sha256;
}

}  // namespace

std::optional<std::string> reason_against(const RigAcceptance& acceptance, const Session& session) {
  if (acceptance.go || calibration_of(session) != acceptance.calibration_sha256)
    return std::nullopt;
  return "the acceptance of this calibration is NO-GO: " +
         acceptance.cause.value_or("a figure is beyond its limit or was not measured");
}

std::optional<std::string> reason_in_store(const std::filesystem::path& store,
                                           const Session& session) {
  if (!std::filesystem::is_regular_file(store)) return std::nullopt;
  RigAcceptance last;
  last.calibration_sha256 = calibration_of(session);
  const Table rows = StoreReader(store).query(
      "SELECT a.verdict, a.cause FROM acceptance AS a JOIN ledger AS l ON l.kind = 'acceptance' "
      "AND l.key = a.sha256 WHERE a.calibration_sha256 = ? ORDER BY a.date DESC, l.sequence DESC "
      "LIMIT 1",
      {last.calibration_sha256});
  if (rows.rows.empty()) return std::nullopt;
  last.go = rows.rows[0][0] == "GO";
  if (!rows.rows[0][1].empty()) last.cause = rows.rows[0][1];
  return reason_against(last, session);
}

std::vector<std::string> doubts_of(const RigAcceptance& acceptance, const Session& session) {
  std::vector<std::string> doubts;
  const std::string again = ": record the target again and run drape accept";
  const std::string measured_with = calibration_of(session);
  std::optional<std::string> day;
  for (const DrapeFiles& drape : session.drapes) {
    if (drape.recording && drape.recording->recorded_on)
      day = std::max(day.value_or(""), *drape.recording->recorded_on);
  }
  if (!measured_with.empty() && measured_with != acceptance.calibration_sha256)
    doubts.push_back("the last acceptance is of another calibration, older than this one" + again);
  if (day && acceptance.valid_until && *day > *acceptance.valid_until)
    doubts.push_back(
        fmt::format("the last acceptance expired on {}, the drapes were recorded on {}{}",
                    *acceptance.valid_until, *day, again));
  return doubts;
}

std::optional<RigAcceptance> look_at_acceptance(const std::filesystem::path& file,
                                                const Session& session, Outcome& outcome,
                                                RunRecord& record) {
  if (file.empty()) return std::nullopt;
  RigAcceptance acceptance = read_acceptance(file);
  record.input(file, acceptance.sha256);
  outcome.not_accepted = reason_against(acceptance, session);
  for (std::string& doubt : doubts_of(acceptance, session))
    outcome.warnings.push_back(std::move(doubt));
  return acceptance;
}

void store_acceptance(const std::filesystem::path& store, const RigAcceptance& acceptance) {
  Store results(store);
  results.write([&](Writer& writer) {
    if (writer.insert("rig", acceptance.rig)) writer.enter("rig", acceptance.rig);
    if (!writer.insert("acceptance", acceptance.sha256, acceptance.rig,
                       acceptance.calibration_sha256, acceptance.date, acceptance.valid_until,
                       acceptance.positions, std::string(acceptance.go ? "GO" : "NO-GO"),
                       acceptance.cause))
      return;
    for (const RigAcceptance::Figure& figure : acceptance.figures)
      writer.insert("acceptance_figure", acceptance.sha256, figure.name, figure.unit, figure.value,
                    figure.expanded, figure.limit, figure.where,
                    std::string(figure.go ? "GO" : "NO-GO"));
    writer.enter("acceptance", acceptance.sha256);
  });
  results.close();
}

}  // namespace drape::compare

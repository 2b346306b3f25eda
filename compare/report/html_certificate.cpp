// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>

#include "compare/report/html.hpp"
#include "compare/store/runs.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Two columns without a header row; an absent value is left out.
Table facts_table(const std::vector<std::pair<std::string, std::string>>& facts) {
  Table table({"what", "value"});
  table.headings = {"", ""};
  for (const auto& [what, value] : facts)
    if (!value.empty()) table.add({what, value});
  return table;
}

std::string calibration_line(const Session& session) {
  if (!session.calibration) return "not given";
  const Calibration& own = *session.calibration;
  double px = 0, object_mm = 0;
  for (const CalibratedCamera& camera : own.cameras) {
    px = std::max(px, camera.residuals.rms_px);
    object_mm = std::max(object_mm, camera.residuals.object_rms_mm);
  }
  return fmt::format(
      "{} cameras, {}, {} sets; target points within {:.4f} px RMS, {:.4f} mm of "
      "their rays; {}; SHA-256 {}",
      own.cameras.size(), own.method, own.sets.size(), px, object_mm,
      own.no_go ? "NO-GO: " + *own.no_go : std::string("GO"),
      session.calibration_sha256.substr(0, 12));
}

/// The run, and what it rests on.
Table run_table(const Session& session, const Outcome& outcome) {
  std::set<std::string> rigs, recordings, fabrics, stand_ins;
  for (const DrapeFiles& drape : session.drapes) {
    rigs.insert(drape.input.measured.measured().rig);
    if (drape.recording)
      recordings.insert(fmt::format(
          "{}{}, SHA-256 {}", drape.recording->name,
          drape.recording->recorded_on ? " of " + *drape.recording->recorded_on : std::string(),
          drape.recording->sha256.substr(0, 12)));
    for (const Simulation& simulation : drape.input.simulations)
      if (!simulation.other_simulator) fabrics.insert(simulation.source().fabric);
  }
  for (const RunValue& value : values_of(session, outcome))
    if (value.key == "stand_ins" && !value.value.empty())
      stand_ins.insert(value.owner + ": " + value.value);
  if (stand_ins.empty()) stand_ins.insert("none");
  const auto joined = [](const auto& words) { return fmt::format("{}", fmt::join(words, ", ")); };
  return facts_table(
      {{"run",
        outcome.run == 0
            ? ""
            : fmt::format("{} of {}, stored {}", outcome.run,
                          std::filesystem::path(outcome.store).filename().string(), outcome.date)},
       {"label", outcome.label},
       {"operator", outcome.operator_name},
       {"rig", joined(rigs)},
       {"recording", joined(recordings)},
       {"calibration", calibration_line(session)},
       {"fabric", joined(fabrics)},
       {"not measured (stand-ins)", joined(stand_ins)},
       {"program", "drapebench " + version()}});
}

/// One row per drape: both verdicts, the distance and U.
Table drapes_table(const Session& session, const Outcome& outcome) {
  Table table({"drape", "measurement", "marks", "uncertainty of a mark (mm)", "simulation",
               "mean distance (mm)", "± U (mm), 95 %", "match", "by"},
              {2, 3, 5, 6});
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    std::string simulation, mean, expanded;
    if (report.headline) {
      const RealVirtual& row = report.real_virtual[*report.headline];
      simulation = session.drapes[i].input.simulations[row.simulation].label();
      mean = mm_text(row.statistics.mean_m);
    }
    if (report.budget)
      expanded = fmt::format("{}{:.3f}", report.budget->missing.empty() ? "" : "at least ",
                             report.budget->expanded_m / mm);
    table.add({report.called(), report.go() ? "GO" : "NO-GO",
               std::to_string(report.measurement.marks), mm_text(report.measurement.sigma_median_m),
               simulation, mean, expanded, name_of(report.match.match), report.match.rests_on});
  }
  return table;
}

/// Findings of the calibration that its file does not hold: the error on views that it did not use,
/// the stages. From the ending that its program kept.
Table calibration_findings(const Session& session) {
  const auto ending = kept_ending(run_record_path(session.calibration_file));
  return ending ? facts_table(ending->numbers) : Table();
}

std::string link(const std::string& target, const std::string& text) {
  return "<a href=\"#" + xml(target) + "\">" + xml(text) + "</a>";
}

}  // namespace

std::string html_certificate(const Session& session, const Outcome& outcome) {
  std::string text = "<section id=\"certificate\" class=\"certificate\">\n<h2>Certificate</h2>\n";
  text += html_table(drapes_table(session, outcome));
  for (const Report& report : outcome.reports) {
    text += "<p><b>" + xml(report.called()) + "</b>: match " + name_of(report.match.match) + "; " +
            xml(report.match.reason) + ".";
    if (!report.go()) text += " <b>NO-GO:</b> " + xml(report.no_go.front()) + ".";
    if (report.budget) text += " " + xml(budget_sentence(*report.budget)) + ".";
    text += "</p>\n";
    if (report.match.bases.size() > 1) text += html_table(basis_table(report));
    text += html_table(repeats_table(report));
  }
  text += html_table(run_table(session, outcome));
  text += html_note(
              "GO says that the marks were measured within their stated uncertainties; it says "
              "nothing of the simulation. Match says whether the simulation could be one more "
              "laying of the real drape, or, where it was laid fewer than three times, how far it "
              "is from it, against the total uncertainty. The simulation was chosen before any "
              "distance was known: the scene's own start on the finest mesh with five segments.") +
          "<p>";
  for (const Report& report : outcome.reports)
    if (report.headline || !report.real_surface.empty())
      text += link("drape-" + report.name, "Drape " + report.called()) + " · ";
  if (session.calibration) text += link("calibration", "Calibration") + " · ";
  text += link("provenance", "Provenance") + "</p>\n";
  return text + "</section>\n";
}

std::string html_calibration(const Session& session) {
  if (!session.calibration) return {};
  const Calibration& own = *session.calibration;
  Table table({"camera", "points", "RMS (px)", "largest (px)", "RMS (mm)", "covered u (px)",
               "covered v (px)"},
              {1, 2, 3, 4});
  for (const CalibratedCamera& camera : own.cameras) {
    const auto& region = camera.valid_region_px;
    table.add(
        {camera.camera.name, std::to_string(camera.residuals.points),
         fmt::format("{:.4f}", camera.residuals.rms_px),
         fmt::format("{:.4f}", camera.residuals.max_px),
         fmt::format("{:.4f}", camera.residuals.object_rms_mm),
         fmt::format("{:.0f} to {:.0f} of {}", region[0], region[2], camera.camera.model.width_px),
         fmt::format("{:.0f} to {:.0f} of {}", region[1], region[3],
                     camera.camera.model.height_px)});
  }
  std::string text = "<section id=\"calibration\">\n<h2>Calibration</h2>\n" +
                     html_paragraph(calibration_line(session) + ".") + html_table(table) +
                     html_table(calibration_findings(session), "dense");
  for (const std::string& warning : own.warnings) text += html_note(warning);
  return text + "</section>\n";
}

std::string html_values(const Session& session, const Outcome& outcome, const std::string& drape) {
  Table table({"file", "value", "is", "measured"});
  std::string fabric;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const auto& scene = session.drapes[i].input.scene;
    if (outcome.reports[i].name == drape && scene)
      fabric = "fabric " + scene->fabric_file.stem().string();
  }
  for (const RunValue& value : values_of(session, outcome))
    if ((value.owner == "scene " + drape || value.owner == fabric) && value.key != "stand_ins")
      table.add({value.owner, value.key, value.value, value.stand_in ? "no: stand-in" : ""});
  return table.rows.empty() ? "" : "<h3>Scene and fabric</h3>\n" + html_table(table, "dense");
}

}  // namespace drape::compare

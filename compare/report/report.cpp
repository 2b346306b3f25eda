// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "compare/report/figures.hpp"
#include "compare/report/html.hpp"
#include "compare/report/viewer.hpp"
#include "core/files/files.hpp"
#include "core/program/run_record.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;
using units::mm;

const CalibratedCamera* calibrated(const Session& session, const std::string& name) {
  if (!session.calibration) return nullptr;
  for (const CalibratedCamera& camera : session.calibration->cameras)
    if (camera.camera.name == name) return &camera;
  return nullptr;
}

std::vector<Figure> overlays_of(const DrapeFiles& drape, const Report& report,
                                const Session& session) {
  std::vector<Figure> figures;
  if (!drape.detections) return figures;
  const std::string& set = std::get<MeasuredSource>(drape.input.measured.sheet.source).set;
  for (const FrameDetections& frame : drape.detections->frames) {
    if (frame.set != set) continue;
    std::vector<unsigned char> preview;
    if (frame.preview_file) {
      const fs::path file = drape.detections_file.parent_path() / *frame.preview_file;
      if (fs::is_regular_file(file)) preview = read_bytes(file);
    }
    figures.push_back(overlay_figure(report.name, frame, preview, calibrated(session, frame.camera),
                                     drape.input, report.real_virtual[*report.best]));
  }
  return figures;
}

std::vector<Figure> renders_of(const DrapeFiles& drape, const Report& report,
                               const Session& session) {
  std::vector<Figure> figures;
  if (!drape.detections) return figures;
  const std::string& set = std::get<MeasuredSource>(drape.input.measured.sheet.source).set;
  for (const FrameDetections& frame : drape.detections->frames) {
    const CalibratedCamera* camera = calibrated(session, frame.camera);
    if (frame.set != set || camera == nullptr) continue;
    figures.push_back(
        render_figure(report.name, frame, *camera, drape.input, report.real_virtual[*report.best]));
  }
  return figures;
}

/// Curves that the best simulation read and that are still the same.
std::optional<Figure> fabric_of(const DrapeFiles& drape, const Report& report) {
  const auto& made_by = drape.simulated_by[report.real_virtual[*report.best].simulation];
  if (!made_by) return std::nullopt;
  std::vector<FabricCurve> curves;
  for (const auto& [file, sha256] : made_by->inputs) {
    if (file.extension() != ".csv" || !fs::is_regular_file(file) || sha256_of_file(file) != sha256)
      continue;
    std::string name = file.stem().string();
    std::replace(name.begin(), name.end(), '_', ' ');
    History points = read_history(file);
    if (points.names.size() >= 2 && !points.columns[0].empty())
      curves.push_back({name, std::move(points)});
  }
  if (curves.empty()) return std::nullopt;
  return fabric_figure(report.name, curves);
}

DrapeFigures figures_of(const DrapeFiles& drape, const Report& report, const Session& session) {
  const RealVirtual& best = report.real_virtual[*report.best];
  return {overlays_of(drape, report, session),
          renders_of(drape, report, session),
          sheet_figure(report.name, drape.input, best),
          map_figure(report.name, drape.input, best),
          histogram_figure(report.name, best),
          strain_figure(report.name, drape.input, best),
          convergence_figure(report.name, drape.input, report),
          hem_figure(report.name, drape.input, report),
          fabric_of(drape, report)};
}

std::string verdict_part(const Outcome& outcome) {
  const bool go = outcome.go();
  std::string text =
      fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{}", go ? "go" : "stop",
                  go ? "GO" : "NO-GO", go ? xml(outcome.sentence()) : "");
  if (!go) {
    text += "<ul>";
    for (const std::string& reason : outcome.reasons()) text += "<li>" + xml(reason) + "</li>";
    text += "</ul>";
  }
  text += "</div>\n";
  for (const std::string& warning : outcome.warnings)
    text += "<p><b>Warning.</b> " + xml(warning) + "</p>\n";
  return text;
}

std::string overview_part(const Session& session, const Outcome& outcome) {
  Table table;
  table.names = {"drape",
                 "verdict",
                 "best mean distance (mm)",
                 "± (mm)",
                 "part of the patch",
                 "best simulation",
                 "marks",
                 "gaps",
                 "sigma of a mark (mm)"};
  table.numeric = {false, false, true, true, false, false, true, true, true};
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    const DrapeInput& input = session.drapes[i].input;
    std::vector<std::string> cells = {report.name, report.go() ? "GO" : "NO-GO", "", "", "", ""};
    if (report.best) {
      const RealVirtual& best = report.real_virtual[*report.best];
      cells[2] = mm_text(best.statistics.mean_m);
      if (best.statistics.sigma_mean_m)
        cells[3] = fmt::format("{:.4f}", *best.statistics.sigma_mean_m / mm);
      cells[4] = percent_text(best.statistics.mean_m, input.measured.sheet.patch_m);
      cells[5] = input.simulations[best.simulation].label();
    }
    cells.push_back(std::to_string(report.measurement.marks));
    cells.push_back(std::to_string(report.measurement.gaps));
    cells.push_back(mm_text(report.measurement.sigma_median_m));
    table.add(std::move(cells));
  }
  return html_table(table);
}

/// Writes one file beside the report and remembers it.
void write_beside(const fs::path& folder, const std::string& name, const std::string& text,
                  std::vector<fs::path>& written) {
  written.push_back(folder / name);
  write_durable(written.back(), text);
}

void write_exports(const fs::path& folder, const DrapeFiles& drape, const Report& report,
                   const DrapeFigures& figures, std::vector<fs::path>& written) {
  const DrapeInput& input = drape.input;
  std::vector<const Figure*> all;
  for (const Figure& figure : figures.overlays) all.push_back(&figure);
  for (const Figure& figure : figures.renders) all.push_back(&figure);
  for (const Figure* figure : {&figures.sheet, &figures.map, &figures.histogram, &figures.strain})
    all.push_back(figure);
  for (const auto* figure : {&figures.convergence, &figures.hem, &figures.fabric})
    if (*figure) all.push_back(&**figure);
  for (const Figure* figure : all)
    write_beside(folder, figure->name + ".svg", figure->svg, written);
  const auto csv = [&](const std::string& name, const Table& table) {
    write_beside(folder, report.name + name, csv_of(table), written);
  };
  csv("-real-vs-virtual.csv", real_virtual_table(input, report));
  if (!report.real_surface.empty()) csv("-real-vs-surface.csv", surface_table(input, report));
  for (std::size_t i = 0; i < report.branch_sets.size(); ++i) {
    csv(i == 0 ? "-branches.csv" : fmt::format("-branches-{}.csv", i + 1),
        branch_table(input, report, report.branch_sets[i]));
  }
  csv("-virtual-vs-virtual.csv", virtual_virtual_table(report));
  csv("-marks.csv", mark_table(input, report));
  csv("-gaps.csv", gap_table(input, report));
  const RealVirtual& best = report.real_virtual[*report.best];
  csv("-trust.csv", trust_table(input, best));
  csv("-strain.csv", strain_table(best));
  csv("-drapemeter.csv", drapemeter_table(input, report));
  if (!drape.error_split) return;
  csv("-fabric-values.csv", value_effect_table(*drape.error_split));
  csv("-model-changes.csv", variant_effect_table(*drape.error_split));
}

/// Drape names become file names: anything but letters, digits, `-` and `_` is replaced.
Report with_safe_name(Report report) {
  for (char& c : report.name)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
  return report;
}

}  // namespace

std::vector<fs::path> write_report(const fs::path& file, const Session& session,
                                   const Outcome& outcome) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::vector<fs::path> written;
  std::string drapes;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = outcome.reports[i];
    if (!report.best) {
      if (!report.real_surface.empty())
        drapes += "<section>\n<h2>Drape " + xml(report.name) + "</h2>\n" +
                  html_surfaces(session.drapes[i].input, report) + "</section>\n";
      continue;
    }
    const Report safe = with_safe_name(report);
    const DrapeFigures figures = figures_of(session.drapes[i], safe, session);
    drapes += html_drape(session.drapes[i], report, session, figures);
    write_exports(folder / file.stem(), session.drapes[i], safe, figures, written);
  }
  for (const VirtualGroup& group : outcome.groups)
    drapes += "<section>\n<h2>Simulations of " + xml(group.name) + "</h2>\n" +
              html_table(virtual_group_table(group)) + "</section>\n";
  const std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>Real and virtual drapes: " +
      std::string(outcome.go() ? "GO" : "NO-GO") + "</title>\n<style>" + html_style() +
      "</style>\n</head>\n<body>\n<main>\n<h1>drapebench " + version() +
      " · distance between real and virtual drapes</h1>\n" + verdict_part(outcome) +
      overview_part(session, outcome) + drapes + html_provenance(session, outcome, folder) +
      "</main>\n" +
      (drapes.find("class=\"turn\"") != std::string::npos ? viewer_script() : std::string()) +
      "</body>\n</html>\n";
  write_durable(file, html);
  written.push_back(file);
  return written;
}

}  // namespace drape::compare

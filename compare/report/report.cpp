// SPDX-License-Identifier: Apache-2.0
#include "compare/report/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>

#include "compare/report/figures.hpp"
#include "compare/report/html.hpp"
#include "compare/report/viewer.hpp"
#include "core/files/files.hpp"
#include "core/files/inside.hpp"
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

/// The photographs of the drape with the marks, and with a calibration what each camera would see.
void add_photographs(const DrapeFiles& drape, const Report& report, const Session& session,
                     DrapeFigures& figures) {
  if (!drape.detections) return;
  const RealVirtual& headline = report.real_virtual[*report.headline];
  const std::string& set = drape.input.measured.measured().set;
  for (const FrameDetections& frame : drape.detections->frames) {
    if (frame.set != set) continue;
    std::vector<unsigned char> preview;
    if (frame.preview_file) {
      const fs::path folder = drape.detections_file.parent_path();
      const Where where{.file = drape.detections_file.string(), .field = "preview_file"};
      if (fs::is_regular_file(name_inside(folder, *frame.preview_file, where)))
        preview = read_inside(folder, *frame.preview_file, where);
    }
    const CalibratedCamera* camera = calibrated(session, frame.camera);
    figures.overlays.push_back(
        overlay_figure(report.name, frame, preview, camera, drape.input, headline));
    if (camera != nullptr)
      figures.renders.push_back(render_figure(report.name, frame, *camera, drape.input, headline));
  }
}

DrapeFigures figures_of(const DrapeFiles& drape, const Report& report, const Session& session) {
  const RealVirtual& headline = report.real_virtual[*report.headline];
  DrapeFigures figures{{},
                       {},
                       sheet_figure(report.name, drape.input, headline),
                       map_figure(report.name, drape.input, headline),
                       histogram_figure(report.name, headline),
                       strain_figure(report.name, drape.input, headline),
                       hem_figure(report.name, drape.input, report)};
  add_photographs(drape, report, session, figures);
  return figures;
}

std::string verdict_part(const Outcome& outcome) {
  const bool go = outcome.go();
  std::string text =
      fmt::format("<div class=\"verdict {}\"><strong>{}</strong>{}", go ? "go" : "stop",
                  go ? "Measurement GO" : "Measurement NO-GO", go ? xml(outcome.sentence()) : "");
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

/// Writes one file beside the report and remembers it.
void write_beside(const fs::path& folder, const std::string& name, const std::string& text,
                  std::vector<fs::path>& written) {
  written.push_back(folder / name);
  write_inside(folder, name, text, {.file = written.back().string()});
}

void write_exports(const fs::path& folder, const DrapeFiles& drape, const Report& report,
                   const DrapeFigures& figures, std::vector<fs::path>& written) {
  const DrapeInput& input = drape.input;
  for (const Figure* figure : figures.all())
    write_beside(folder, figure->name + ".svg", figure->svg, written);
  const auto csv = [&](const std::string& name, const Table& table) {
    write_beside(folder, report.name + name, csv_of(table), written);
  };
  csv("-real-vs-virtual.csv", real_virtual_table(input, report));
  if (!report.real_surface.empty()) csv("-real-vs-surface.csv", surface_table(input, report));
  for (std::size_t i = 0; i < report.branch_sets.size(); ++i) {
    csv(i == 0 ? "-branches.csv" : fmt::format("-branches-{}.csv", i + 1),
        branch_table(input, report, report.branch_sets[i]));
    const Simulation* speaks = input.speaking_branch();
    if (speaks == nullptr || speaks->branch->set_sha256 != report.branch_sets[i].sha256) continue;
    if (const auto figure = band_figure(report.name, input, report.branch_sets[i]))
      write_beside(folder, figure->name + ".svg", figure->svg, written);
  }
  csv("-virtual-vs-virtual.csv", virtual_virtual_table(report));
  csv("-marks.csv", mark_table(input, report));
  csv("-gaps.csv", gap_table(input, report));
  const RealVirtual& headline = report.real_virtual[*report.headline];
  csv("-trust.csv", trust_table(input, headline));
  csv("-strain.csv", strain_table(headline));
  csv("-drapemeter.csv", drapemeter_table(input, report));
  csv("-folds.csv", shape_table(input));
  csv("-waves.csv", wave_table(input));
  if (!drape.error_split) return;
  csv("-fabric-values.csv", value_effect_table(*drape.error_split));
  csv("-model-changes.csv", variant_effect_table(*drape.error_split));
}

/// Pictures and tables of an earlier report, whose drapes this one may not have; by their names,
/// for the folder may hold files of other people.
void remove_others(const fs::path& folder, const std::vector<fs::path>& written) {
  static const std::regex of_a_report(
      "[A-Za-z0-9_-]+-(band|branches|convergence|drapemeter|fabric|fabric-values|folds|gaps|hem|"
      "histogram|"
      "map|marks|model-changes|overlay|real-vs-surface|real-vs-virtual|render|sheet|strain|trust|"
      "virtual-vs-virtual|waves)(-.*)?\\.(csv|svg)");
  if (!fs::is_directory(folder)) return;
  std::set<std::string> names;
  for (const fs::path& file : written) names.insert(file.filename().string());
  std::vector<fs::path> others;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !entry.is_symlink() && !names.contains(name) &&
        std::regex_match(name, of_a_report))
      others.push_back(entry.path());
  }
  for (const fs::path& file : others) remove_durable(file);
}

/// Names of drapes become names of files and places of the page: anything but letters, digits, `-`
/// and `_` is replaced, and what is the same then gets a number. Headings keep what they called it.
Outcome with_safe_names(Outcome outcome) {
  std::set<std::string> taken;
  for (Report& report : outcome.reports) {
    report.label = report.called();
    for (char& c : report.name)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '-' && c != '_') c = '_';
    const std::string base = report.name;
    for (int n = 2; !taken.insert(report.name).second; ++n)
      report.name = fmt::format("{}_{}", base, n);
  }
  return outcome;
}

}  // namespace

std::vector<const Figure*> DrapeFigures::all() const {
  std::vector<const Figure*> list = {&sheet, &map, &histogram, &strain};
  for (const auto* figures : {&overlays, &renders})
    for (const Figure& figure : *figures) list.push_back(&figure);
  if (hem) list.push_back(&*hem);
  return list;
}

std::vector<fs::path> write_report(const fs::path& file, const Session& session,
                                   const Outcome& outcome) {
  const Outcome safe = with_safe_names(outcome);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::vector<fs::path> written;
  std::string drapes;
  for (std::size_t i = 0; i < outcome.reports.size(); ++i) {
    const Report& report = safe.reports[i];
    if (!report.headline) {
      if (!report.real_surface.empty())
        drapes += "<section id=\"drape-" + report.name + "\">\n<h2>Drape " + xml(report.called()) +
                  "</h2>\n" + html_surfaces(session.drapes[i].input, report) + "</section>\n";
      continue;
    }
    const DrapeFigures figures = figures_of(session.drapes[i], report, session);
    drapes += html_drape(session.drapes[i], report, session, figures,
                         html_values(session, outcome, outcome.reports[i].name));
    write_exports(folder / file.stem(), session.drapes[i], report, figures, written);
  }
  for (const VirtualGroup& group : outcome.groups)
    drapes += "<section>\n<h2>Simulations of " + xml(group.name) + "</h2>\n" +
              html_table(virtual_group_table(group)) + "</section>\n";
  remove_others(folder / file.stem(), written);
  const bool turns = drapes.find("class=\"turn\"") != std::string::npos;
  const std::string html = html_page(
      std::string("Real and virtual drapes: measurement ") + (outcome.go() ? "GO" : "NO-GO"),
      "<h1>drapebench " + version() + " · distance between real and virtual drapes</h1>\n" +
          verdict_part(outcome) + html_certificate(session, safe) + drapes +
          html_calibration(session) + html_provenance(session, outcome, folder),
      turns ? viewer_scripts() : std::vector<std::string>());
  write_durable(file, html);
  written.push_back(file);
  return written;
}

}  // namespace drape::compare

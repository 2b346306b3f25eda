// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compare/report/band.hpp"
#include "compare/report/html.hpp"
#include "compare/report/viewer.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

std::string fact(const std::string& value, const std::string& what) {
  return fmt::format("<li><b>{}</b><span>{}</span></li>\n", xml(value), xml(what));
}

std::string facts(const DrapeInput& input, const Report& report) {
  const Measurement& m = report.measurement;
  const RealVirtual& headline = report.real_virtual[*report.headline];
  const DistanceStatistics& s = headline.statistics;
  const Simulation& simulation = input.simulations[headline.simulation];
  std::string text = "<ul class=\"facts\">\n";
  text += fact(fmt::format("{:.2f} mm", s.mean_m / mm),
               fmt::format("mean distance real to virtual ({})", simulation.label()));
  const std::string of_side = percent_text(s.mean_m, input.measured.sheet.patch_m);
  const std::size_t sign = of_side.find('%') + 1;
  text += fact(of_side.substr(0, sign), of_side.substr(sign));
  text += fact(std::to_string(m.marks), fmt::format("marks measured, {} gaps", m.gaps));
  if (m.sigma_median_m) {
    text += fact(fmt::format("{:.3f} mm", *m.sigma_median_m / mm),
                 fmt::format("uncertainty of a mark (1 sigma, median; largest {:.3f} mm)",
                             *m.sigma_max_m / mm));
  }
  if (report.budget)
    text +=
        fact(fmt::format("± {:.3f} mm", report.budget->expanded_m / mm),
             report.budget->missing.empty() ? "total uncertainty U of the mean (95 %)"
                                            : "total uncertainty U of the mean (95 %), at least");
  text += fact(name_of(report.match.match),
               report.match.rests_on.empty() ? "match" : "match, by " + report.match.rests_on);
  return text + "</ul>\n";
}

/// The parts of the error that have a direction, so that warp and weft stay apart.
Table direction_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.title = "Where the real marks lie, seen from the virtual sheet";
  table.names = {"grid size",
                 "segments",
                 "mean along warp (mm)",
                 "mean along weft (mm)",
                 "mean along normal (mm)",
                 "RMS warp (mm)",
                 "RMS weft (mm)",
                 "RMS normal (mm)"};
  table.numeric.assign(table.names.size(), true);
  table.numeric.front() = false;
  for (const RealVirtual& row : report.real_virtual) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
    for (const MarkError& mark : row.marks.marks) {
      mean += mark.warp_weft_normal_m;
      squares += mark.warp_weft_normal_m.cwiseAbs2();
    }
    const auto n = static_cast<double>(row.marks.marks.size());
    const Eigen::Vector3d average = mean / n / mm, rms = (squares / n).cwiseSqrt() / mm;
    const Simulation& simulation = input.simulations[row.simulation];
    std::vector<std::string> cells = {simulation.grid() + simulation.apart_text(),
                                      simulation.segments_text()};
    // Adding zero turns a rounded -0.00 into +0.00.
    for (int k = 0; k < 3; ++k)
      cells.push_back(fmt::format("{:+.2f}", std::round(average[k] * 100) / 100 + 0.0));
    for (int k = 0; k < 3; ++k) cells.push_back(fmt::format("{:.2f}", rms[k]));
    table.add(std::move(cells));
  }
  table.marked_row = report.headline;
  return table;
}

Table headline_mark_table(const RealVirtual& headline) {
  Table table;
  table.names = {"row", "col", "dist (mm)", "± (mm)", "sigma (mm)", "views"};
  table.numeric.assign(table.names.size(), true);
  for (const MarkError& mark : headline.marks.marks) {
    const auto sigma = [](const std::optional<double>& s) {
      return s ? fmt::format("{:.3f}", *s / mm) : std::string("unknown");
    };
    table.add({std::to_string(mark.mark.row), std::to_string(mark.mark.col),
               fmt::format("{:.2f}", mark.distance_m / mm), sigma(mark.sigma_distance_m),
               sigma(mark.sigma_mark_m), mark.views ? std::to_string(*mark.views) : ""});
  }
  return table;
}

/// Per-mark table with the marks as the cameras saw them, one part per row of the patch so that
/// the parts flow into columns.
std::string mark_tables(const std::string& name, const DrapeFiles& drape,
                        const RealVirtual& headline) {
  const Table all = headline_mark_table(headline);
  std::string text = "<div class=\"marks\">\n";
  Table part = all;
  part.rows.clear();
  PictureColumn crops{"as seen", {}};
  bool any = false;
  for (std::size_t i = 0; i < all.rows.size(); ++i) {
    part.rows.push_back(all.rows[i]);
    crops.cells.push_back(crops_of_mark(name, drape, headline.marks.marks[i].mark));
    any = any || !crops.cells.back().empty();
    if (i + 1 < all.rows.size() && all.rows[i + 1][0] == all.rows[i][0]) continue;
    text += "<figure>" + html_table(part, "dense", any ? crops : PictureColumn{}) + "</figure>";
    part.rows.clear();
    crops.cells.clear();
  }
  return text + "</div>\n";
}

/// Kinds of gaps with their counts.
Table gap_summary(const Table& gaps) {
  std::map<std::string, int> counts;
  for (const auto& gap : gaps.rows) ++counts[kind_of_gap(gap.back())];
  Table table;
  table.names = {"reason", "marks"};
  table.numeric = {false, true};
  for (const auto& [kind, count] : counts) table.add({kind, std::to_string(count)});
  return table;
}

/// What the report leaves to the certificate itself: the options and the fits of the curves.
bool is_detail(const std::string& entry) {
  return entry.starts_with("options.") || entry.starts_with("curves.");
}

/// One column per simulation, one row per entry of the certificates.
Table certificate_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.names = {"certificate entry"};
  std::vector<std::string> entries;
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    if (!simulation.certificate) continue;
    table.names.push_back(simulation.label());
    for (const auto& [name, value] : simulation.certificate->entries)
      if (!is_detail(name) && std::find(entries.begin(), entries.end(), name) == entries.end())
        entries.push_back(name);
  }
  for (const std::string& entry : entries) {
    std::vector<std::string> cells = {entry};
    for (const RealVirtual& row : report.real_virtual) {
      const Simulation& simulation = input.simulations[row.simulation];
      if (!simulation.certificate) continue;
      std::string value;
      for (const auto& [name, text] : simulation.certificate->entries)
        if (name == entry) value = text;
      cells.push_back(value);
    }
    table.add(std::move(cells));
  }
  table.numeric.assign(table.names.size(), false);
  return table;
}

Table status_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.names = {"grid size", "segments", "model", "solver", "fabric", "status"};
  table.numeric = {false, true, false, false, false, false};
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const SimulatedSource& source = simulation.source();
    table.add({simulation.grid(), simulation.segments_text(), source.model, source.solver,
               source.fabric, source.status});
  }
  return table;
}

std::string simulations_part(const DrapeFiles& drape, const Report& report,
                             const DrapeFigures& figures) {
  std::string text = "<h3>Simulations</h3>\n" + html_table(status_table(drape.input, report));
  if (figures.convergence) text += html_figure(*figures.convergence, "chart");
  if (figures.fabric) text += html_figure(*figures.fabric, "chart");
  const Table certificates = certificate_table(drape.input, report);
  if (certificates.rows.empty()) return text;
  text += html_table(certificates, "dense") +
          "<p class=\"soft\">Options and curve fits are in the full certificate.json beside each "
          "simulated sheet, and in the store.</p>\n";
  return text;
}

std::string shape_part(const DrapeFiles& drape, const Report& report, const DrapeFigures& figures) {
  std::string text = "<h3>Shape</h3>\n" + html_table(drapemeter_table(drape.input, report));
  if (figures.hem) text += html_figure(*figures.hem, "chart");
  const StrainSummary& s = report.real_virtual[*report.headline].strain.difference;
  if (s.warp && s.weft && s.area) {
    text += fmt::format(
        "<p>Real minus virtual strain between marks, RMS: {:.2f} % along the warp, {:.2f} % along "
        "the weft, {:.2f} % of area.</p>\n",
        *s.warp / units::percent, *s.weft / units::percent, *s.area / units::percent);
  }
  return text + html_figure(figures.strain);
}

std::string tables_part(const DrapeFiles& drape, const Report& report) {
  Table real = real_virtual_table(drape.input, report);
  real.marked_row = report.headline;
  std::string text = "<h3>Distances</h3>\n" + html_table(real);
  text += html_branches(drape.input, report);
  text += html_surfaces(drape.input, report);
  if (!report.virtual_virtual.empty()) {
    text += html_table(virtual_virtual_table(report));
    text += fmt::format("<p class=\"soft\">Simulations are compared at {}.</p>\n",
                        report.lattice_has_gaps_filled
                            ? "all marks of the lattice, the ones that were not measured included"
                            : "the measured marks");
  }
  text +=
      html_table(trust_table(drape.input, report.real_virtual[*report.headline])) +
      "<p class=\"soft\">± is what the measurement leaves open; the interval is what other marks "
      "on the same cloth might have given (2,000 bootstrap resamples). The rigid move is shown "
      "to judge placement; no other number uses it.</p>\n";
  return text + html_table(direction_table(drape.input, report)) +
         "<p class=\"soft\">Real minus virtual along the warp tangent, the weft tangent and the "
         "normal (out of the printed side) of the virtual sheet. Where the cloth shears, the two "
         "tangents are not at right angles and the squares do not add up.</p>\n";
}

}  // namespace

std::string html_surfaces(const DrapeInput& input, const Report& report) {
  if (report.real_surface.empty()) return {};
  return html_table(surface_table(input, report)) +
         "<p class=\"soft\">These meshes do not say which point of the cloth a vertex is. A "
         "distance to a surface is at most the distance of the same material point: cloth that "
         "slid along itself has none. The distance from the mesh contains the hem and the gaps, "
         "where "
         "nothing was measured.</p>\n";
}

std::string html_branches(const DrapeInput& input, const Report& report) {
  std::string text;
  for (const BranchSet& set : report.branch_sets) {
    text +=
        html_table(branch_table(input, report, set)) +
        "<p>The real shape: " + xml(branch_sentence(input, set)) +
        ".</p>\n<p class=\"soft\">A cloth can rest in several shapes. Energies are those of the "
        "model, and only their differences mean anything.";
    if (set.branches.front().turned)
      text +=
          " The object is round, so a shape turned about its axis is the same shape: what counts "
          "is the mean distance after the turn that makes it smallest.";
    text += "</p>\n";
    const Simulation& one = input.simulations[set.branches.front().as_placed.simulation];
    if (!one.is_of_cloth_of(*input.speaker())) continue;
    if (const auto ensemble = ensemble_of(input, set))
      text += "<p>The ensemble: " + xml(ensemble_sentence(*ensemble)) + ".</p>\n";
    const bool speaks = input.speaking_branch()->branch->set_sha256 == set.sha256;
    if (const auto band = friction_band_of(input); band && speaks)
      text += "<p>Friction: " + xml(friction_sentence(*band)) + ".</p>\n";
    if (const auto band = memory_band_of(input); band && speaks)
      text += "<p>Internal friction: " + xml(memory_sentence(*band)) + ".</p>\n";
    if (const auto figure = band_figure(report.name, input, set)) text += html_figure(*figure);
  }
  return text;
}

std::string html_drape(const DrapeFiles& drape, const Report& report, const Session& session,
                       const DrapeFigures& figures, const std::string& values) {
  const RealVirtual& headline = report.real_virtual[*report.headline];
  const Simulation& simulation = drape.input.simulations[headline.simulation];
  std::string text = fmt::format(
      "<section id=\"drape-{0}\">\n<h2>Drape {5}</h2>\n<p class=\"soft\">Set {1} of rig {2}, "
      "fabric "
      "{3}. Pictures and marks below belong to the headline simulation, {4}.</p>\n",
      xml(report.name), xml(std::get<MeasuredSource>(drape.input.measured.sheet.source).set),
      xml(std::get<MeasuredSource>(drape.input.measured.sheet.source).rig),
      xml(simulation.source().fabric), xml(simulation.label()), xml(report.called()));
  text += facts(drape.input, report);
  if (const std::string sentence = distance_sentence(headline); !sentence.empty())
    text += "<p>" + xml(sentence) + ".</p>\n";
  text += viewer_figure(report.name, drape.input, headline);
  text += html_figure(figures.sheet);
  text += tables_part(drape, report);
  if (!figures.overlays.empty()) {
    text += "<h3 id=\"photographs-" + xml(report.name) +
            "\">Photographs</h3>\n<p class=\"soft\">Dots are the measured marks in the colour of "
            "their distance; hollow dots were seen here but not measured in space.";
    if (session.calibration)
      text +=
          " Pink lines are the rows, columns and edges of the virtual cloth, faint where its "
          "back is turned to the camera; a short line leads from each mark to its virtual "
          "place.";
    text += "</p>\n<div class=\"photos\">\n";
    for (std::size_t i = 0; i < figures.overlays.size(); ++i) {
      text += html_figure(figures.overlays[i]);
      if (i < figures.renders.size()) text += html_figure(figures.renders[i]);
    }
    text += "</div>\n";
  }
  text += "<h3>Marks</h3>\n<div class=\"columns\">" + html_figure(figures.map) +
          html_figure(figures.histogram) + "</div>\n" + mark_tables(report.name, drape, headline) +
          "<p class=\"soft\">dist: distance real to virtual; ±: its standard deviation; sigma: "
          "standard deviation of the mark along its worst direction; views: cameras that saw "
          "it.</p>\n";
  const Table gaps = gap_table(drape.input, report);
  text += "<h3>Gaps</h3>\n" + (gaps.rows.empty()
                                   ? std::string("<p>Every mark was measured.</p>\n")
                                   : html_table(gap_summary(gaps)) + html_table(gaps, "dense"));
  text += shape_part(drape, report, figures);
  text += simulations_part(drape, report, figures);
  text += values;
  text += html_error_split(drape);
  text += html_budget(drape, report);
  return text + "</section>\n";
}

}  // namespace drape::compare

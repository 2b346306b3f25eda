// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "compare/report/html.hpp"
#include "compare/report/viewer.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// The parts of the error that have a direction, so that warp and weft stay apart.
Table direction_table(const DrapeInput& input, const Report& report) {
  Table table({"discretisation", "segments", "mean along warp (mm)", "mean along weft (mm)",
               "mean along normal (mm)", "RMS warp (mm)", "RMS weft (mm)", "RMS normal (mm)"},
              {1, 2, 3, 4, 5, 6, 7});
  table.title = "Where the real marks lie, seen from the virtual sheet";
  for (const RealVirtual& row : report.real_virtual) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
    for (const MarkError& mark : row.marks.marks) {
      mean += mark.warp_weft_normal_m;
      squares += mark.warp_weft_normal_m.cwiseAbs2();
    }
    const auto n = static_cast<double>(row.marks.marks.size());
    const Eigen::Vector3d average = mean / n / mm, rms = (squares / n).cwiseSqrt() / mm;
    const Simulation& simulation = input.simulations[row.simulation];
    std::vector<std::string> cells = {simulation.discretisation() + simulation.apart_text(),
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
  Table table({"row", "col", "dist (mm)", "± (mm)", "sigma (mm)", "views"}, {0, 1, 2, 3, 4, 5});
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

/// One mark as each camera saw it, cut out of the photographs of this page; empty without these.
std::string crops_of_mark(const std::string& drape, const DrapeFiles& files, MarkId mark) {
  constexpr double kAroundDot = 2.6;  // half side of a crop over the dot's long semi-axis
  if (!files.detections) return {};
  std::string crops;
  for (const FrameDetections& frame : files.detections->frames) {
    if (frame.set != files.input.measured.measured().set || !frame.preview_file) continue;
    const auto seen = std::find_if(frame.detections.begin(), frame.detections.end(),
                                   [&](const Detection& one) { return one.mark == mark; });
    if (seen == frame.detections.end()) continue;
    const double half = std::max(6.0, kAroundDot * seen->semi_axes_px.x());
    crops += fmt::format(
        "<svg viewBox=\"{} {} {} {}\" role=\"img\" aria-label=\"{}\"><title>{}</title><use "
        "href=\"#{}\"/></svg>",
        coordinate(seen->centre_px.x() - half), coordinate(seen->centre_px.y() - half),
        coordinate(2 * half), coordinate(2 * half), xml(frame.camera), xml(frame.camera),
        xml(photo_id(drape, frame.camera)));
  }
  return crops;
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
  Table table({"reason", "marks"}, {1});
  for (const auto& [kind, count] : counts) table.add({kind, std::to_string(count)});
  return table;
}

/// One column per simulation, one row per entry of the certificates but their options and fits.
Table certificate_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.names = {"certificate entry"};
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    if (!simulation.certificate) continue;
    table.names.push_back(simulation.label());
    for (auto& cells : table.rows) cells.emplace_back();
    for (const auto& [name, value] : simulation.certificate->entries) {
      if (name.starts_with("options.") || name.starts_with("curves.")) continue;
      auto cells = std::find_if(table.rows.begin(), table.rows.end(),
                                [&](const auto& one) { return one.front() == name; });
      if (cells == table.rows.end()) {
        table.add(std::vector<std::string>(table.names.size()));
        cells = table.rows.end() - 1;
        cells->front() = name;
      }
      cells->back() = value;
    }
  }
  table.numeric.assign(table.names.size(), false);
  return table;
}

Table status_table(const DrapeInput& input, const Report& report) {
  Table table({"discretisation", "segments", "model", "fabric", "status"}, {1});
  for (const RealVirtual& row : report.real_virtual) {
    const Simulation& simulation = input.simulations[row.simulation];
    const SimulatedSource& source = simulation.source();
    table.add({simulation.discretisation(), simulation.segments_text(), source.model, source.fabric,
               source.status});
  }
  return table;
}

/// Tables of equilibria, and the one that the real shape took; empty when there are none.
std::string html_branches(const DrapeInput& input, const Report& report) {
  std::string text;
  for (const BranchSet& set : report.branch_sets) {
    text += html_table(branch_table(input, report, set)) +
            html_paragraph("The real shape: " + branch_sentence(input, set) + ".") +
            html_note(std::string("A cloth can rest in several shapes. Energies are those of the "
                                  "model, and only their differences mean anything.") +
                      (set.branches.front().turned
                           ? " The object is round, so a shape turned about its axis is the same "
                             "shape: what counts is the mean distance after the turn that makes it "
                             "smallest."
                           : ""));
    const Simulation& one = input.simulations[set.branches.front().as_placed.simulation];
    if (!one.is_of_cloth_of(*input.speaker())) continue;
    const auto list = list_of(input, set);
    if (list && list->members_at_rest)
      text += html_paragraph("The ensemble: " + ensemble_sentence(*list) + ".");
    if (list && input.speaking_branch()->branch->set_sha256 == set.sha256) {
      if (const auto& band = list->friction_band)
        text += html_paragraph("Friction: " + friction_sentence(*band) + ".");
      if (const auto& band = list->memory_band)
        text += html_paragraph("Internal friction: " + memory_sentence(*band) + ".");
    }
    if (const auto figure = band_figure(report.name, input, set)) text += html_figure(*figure);
  }
  return text;
}

std::string tables_part(const DrapeFiles& drape, const Report& report) {
  Table real = real_virtual_table(drape.input, report);
  real.marked_row = report.headline;
  std::string text = "<h3>Distances</h3>\n" + html_table(real) +
                     html_branches(drape.input, report) + html_surfaces(drape.input, report);
  if (!report.virtual_virtual.empty())
    text += html_table(virtual_virtual_table(report)) +
            html_note(report.lattice_has_gaps_filled
                          ? "Simulations are compared at all marks of the lattice, the ones that "
                            "were not measured included."
                          : "Simulations are compared at the measured marks.");
  return text + html_table(trust_table(drape.input, report.real_virtual[*report.headline])) +
         html_note(
             "± is what the measurement leaves open; the interval is what other marks on the same "
             "cloth might have given (2,000 bootstrap resamples). The rigid move is shown to judge "
             "placement; no other number uses it.") +
         html_table(direction_table(drape.input, report)) +
         html_note(
             "Real minus virtual along the warp tangent, the weft tangent and the normal (out of "
             "the printed side) of the virtual sheet. Where the cloth shears, the two tangents are "
             "not at right angles and the squares do not add up.");
}

std::string photographs_part(const Report& report, bool calibrated, const DrapeFigures& figures) {
  if (figures.overlays.empty()) return {};
  std::string text =
      "<h3 id=\"photographs-" + xml(report.name) + "\">Photographs</h3>\n" +
      html_note(std::string("Dots are the measured marks in the colour of their distance; hollow "
                            "dots were seen here but not measured in space.") +
                (calibrated
                     ? " Pink lines are the rows, columns and edges of the virtual cloth, faint "
                       "where its back is turned to the camera; a short line leads from each mark "
                       "to its virtual place."
                     : "")) +
      "<div class=\"photos\">\n";
  for (std::size_t i = 0; i < figures.overlays.size(); ++i) {
    text += html_figure(figures.overlays[i]);
    if (i < figures.renders.size()) text += html_figure(figures.renders[i]);
  }
  return text + "</div>\n";
}

std::string marks_part(const DrapeFiles& drape, const Report& report, const DrapeFigures& figures) {
  const Table gaps = gap_table(drape.input, report);
  return "<h3>Marks</h3>\n<div class=\"columns\">" + html_figure(figures.map) +
         html_figure(figures.histogram) + "</div>\n" +
         mark_tables(report.name, drape, report.real_virtual[*report.headline]) +
         html_note(
             "dist: distance real to virtual; ±: its standard deviation; sigma: standard deviation "
             "of the mark along its worst direction; views: cameras that saw it.") +
         "<h3>Gaps</h3>\n" +
         (gaps.rows.empty() ? html_paragraph("Every mark was measured.")
                            : html_table(gap_summary(gaps)) + html_table(gaps, "dense"));
}

std::string shape_part(const DrapeFiles& drape, const Report& report, const DrapeFigures& figures) {
  std::string text = "<h3>Shape</h3>\n" + html_table(drapemeter_table(drape.input, report)) +
                     html_table(shape_table(drape.input), "dense");
  if (figures.hem) text += html_figure(*figures.hem, "chart");
  const StrainSummary& s = report.real_virtual[*report.headline].strain.difference;
  if (s.warp && s.weft && s.area)
    text += html_paragraph(fmt::format(
        "Real minus virtual strain between marks, RMS: {:.2f} % along the warp, {:.2f} % along the "
        "weft, {:.2f} % of area.",
        *s.warp / units::percent, *s.weft / units::percent, *s.area / units::percent));
  return text + html_figure(figures.strain);
}

std::string simulations_part(const DrapeFiles& drape, const Report& report) {
  std::string text = "<h3>Simulations</h3>\n" + html_table(status_table(drape.input, report));
  const Table certificates = certificate_table(drape.input, report);
  if (certificates.rows.empty()) return text;
  return text + html_table(certificates, "dense") +
         html_note(
             "Options and curve fits are in the full certificate.json beside each simulated sheet, "
             "and in the store.");
}

/// Shares of the millimetres as `drape simulate sensitivity` found them; empty when it was not run.
std::string error_split_part(const DrapeFiles& drape) {
  if (!drape.error_split) return {};
  const SensitivityFile& split = *drape.error_split;
  std::string text = "<h3>Where the millimetres come from</h3>\n";
  if (const std::string sentence = error_split_sentence(split); !sentence.empty())
    text += html_paragraph("Over " + std::to_string(split.marks) + " marks: " + sentence + ".");
  return text + html_table(value_effect_table(split)) + html_table(variant_effect_table(split)) +
         html_note(
             "drape simulate sensitivity drapes the scene once more (mesh and segments are in its "
             "run "
             "record) and repeats it with one thing changed: from the drape itself, which keeps "
             "the branch, and from the start, which may end on another. The changes do not add "
             "up.");
}

/// Noise makes every distance longer: by at most sigma^2 / d each, to second order.
std::optional<double> noise_excess_m(const RealVirtual& row) {
  double sum = 0;
  for (const MarkError& mark : row.marks.marks) {
    if (!mark.sigma_mark_m || !(mark.distance_m > 0)) return std::nullopt;
    sum += std::min(*mark.sigma_mark_m * *mark.sigma_mark_m / mark.distance_m, *mark.sigma_mark_m);
  }
  return sum / static_cast<double>(row.marks.marks.size());
}

/// The stated uncertainty, and what is not in it.
std::string budget_part(const DrapeFiles& drape, const Report& report) {
  std::string text = "<h3>Uncertainty</h3>\n";
  if (report.budget)
    text += html_table(budget_table(*report.budget)) +
            html_paragraph(budget_sentence(*report.budget) + ".");
  if (const std::string sentence = mesh_sentence(drape.input, report); !sentence.empty())
    text += html_paragraph("The mesh: " + sentence + ".");
  if (const auto& budget = drape.input.measured.sheet.error_budget)
    text += html_note(fmt::format(
        "Of a mark, RMS over the sheet: noise of the dots' centres {:.4f} mm, bent and slanted "
        "dots {:.4f} mm{}.",
        budget->detection_m / mm, budget->dot_shape_m / mm,
        budget->calibration_m ? fmt::format(", cameras {:.4f} mm", *budget->calibration_m / mm)
                              : std::string()));
  if (const auto excess = noise_excess_m(report.real_virtual[*report.headline]))
    text += html_note(fmt::format(
        "Noise only lengthens a distance: the mean is at most {:.4f} mm too long, which is not "
        "subtracted.",
        *excess / mm));
  return text +
         html_note(
             "± of a distance is sqrt(u' C u), with u the unit vector from the real to the virtual "
             "point and C the covariance of the mark. U is the half width that holds 95 of "
             "100 means, the root of the sum of the squares of the lines with its coverage factor; "
             "each line is what its input alone moves. It holds no repeat of the real drape "
             "and no other equilibrium, and what friction leaves open only where an ensemble was "
             "made.");
}

}  // namespace

std::string html_surfaces(const DrapeInput& input, const Report& report) {
  if (report.real_surface.empty()) return {};
  return html_table(surface_table(input, report)) +
         html_note(
             "These meshes do not say which point of the cloth a vertex is. A distance to a "
             "surface is at most the distance of the same material point: cloth that slid along "
             "itself has none. The distance from the mesh contains the hem and the gaps, where "
             "nothing was measured.");
}

std::string html_drape(const DrapeFiles& drape, const Report& report, const Session& session,
                       const DrapeFigures& figures, const std::string& values) {
  const RealVirtual& headline = report.real_virtual[*report.headline];
  const Simulation& simulation = drape.input.simulations[headline.simulation];
  std::string text = fmt::format("<section id=\"drape-{}\">\n<h2>Drape {}</h2>\n", xml(report.name),
                                 xml(report.called())) +
                     html_note(fmt::format(
                         "Set {} of rig {}, fabric {}. Pictures and marks below belong to the "
                         "headline simulation, {}.",
                         drape.input.measured.measured().set, drape.input.measured.measured().rig,
                         simulation.source().fabric, simulation.label()));
  if (const std::string sentence = distance_sentence(headline); !sentence.empty())
    text += html_paragraph(sentence + ".");
  return text + viewer_figure(report.name, drape.input, headline) + html_figure(figures.sheet) +
         tables_part(drape, report) +
         photographs_part(report, session.calibration.has_value(), figures) +
         marks_part(drape, report, figures) + shape_part(drape, report, figures) +
         simulations_part(drape, report) + values + error_split_part(drape) +
         budget_part(drape, report) + "</section>\n";
}

}  // namespace drape::compare

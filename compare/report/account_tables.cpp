// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compare/report/account.hpp"
#include "compare/tables/budget.hpp"
#include "compare/tables/match.hpp"
#include "compare/tables/tables.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Errors by direction, with warp and weft separate.
Table direction_table(const DrapeInput& input, const Report& report) {
  Table table({"simulation", "mean_warp_mm", "mean_weft_mm", "mean_normal_mm", "rms_warp_mm",
               "rms_weft_mm", "rms_normal_mm"},
              {1, 2, 3, 4, 5, 6});
  table.title = "Where the real marks lie, seen from the virtual sheet";
  for (const RealVirtual& row : report.real_virtual) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
    for (const MarkError& mark : row.marks.marks) {
      mean += mark.warp_weft_normal_m;
      squares += mark.warp_weft_normal_m.cwiseAbs2();
    }
    const auto n = static_cast<double>(row.marks.marks.size());
    const Eigen::Vector3d average = mean / n / mm, rms = (squares / n).cwiseSqrt() / mm;
    std::vector<std::string> cells = {input.simulations[row.simulation].label()};
    // Adding zero turns a rounded -0.00 into +0.00.
    for (int k = 0; k < 3; ++k)
      cells.push_back(fmt::format("{:+.2f}", std::round(average[k] * 100) / 100 + 0.0));
    for (int k = 0; k < 3; ++k) cells.push_back(fmt::format("{:.2f}", rms[k]));
    table.add(std::move(cells));
  }
  table.marked_row = report.headline;
  return table;
}

/// One column per simulation and one row per entry of the certificates, except options and fits.
Table certificate_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.title = "What each simulation states about itself";
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

/// Fourier amplitudes of the radius of each shadow's hem.
Table hem_table(const DrapeInput& input, const Report& report) {
  Table table({"sheet", "order", "amplitude_mm"}, {1, 2});
  table.title = "Waves around the hem";
  const auto add = [&](const std::string& sheet, const DrapemeterResult& result) {
    if (!result.value) return;
    for (const Harmonic& one : result.value->spectrum)
      table.add({sheet, std::to_string(one.order), fmt::format("{:.3f}", one.amplitude_m / mm)});
  };
  add("measured marks", report.measured_drapemeter);
  for (const RealVirtual& row : report.real_virtual)
    add(input.simulations[row.simulation].label(), report.drapemeters[row.simulation]);
  return table;
}

}  // namespace

std::vector<ReportedTable> tables_of(const DrapeFiles& drape, const Report& report) {
  const DrapeInput& input = drape.input;
  std::vector<ReportedTable> tables;
  const auto add = [&](const std::string& name, Table table, const char* note = "") {
    if (!table.rows.empty()) tables.push_back({name, note, std::move(table)});
  };
  if (!report.real_surface.empty())
    add("real-vs-surface", surface_table(input, report),
        "These meshes do not say which point of the cloth a vertex is. A distance to a surface is "
        "at most the distance of the same material point: cloth that slid along itself has none. "
        "The distance from the mesh contains the hem and the gaps, where nothing was measured.");
  if (!report.headline) return tables;
  const RealVirtual& headline = report.real_virtual[*report.headline];
  Table real = real_virtual_table(input, report);
  real.marked_row = report.headline;
  add("real-vs-virtual", std::move(real));
  for (std::size_t i = 0; i < report.branch_sets.size(); ++i)
    add(i == 0 ? "branches" : fmt::format("branches-{}", i + 1),
        branch_table(input, report, report.branch_sets[i]));
  add("virtual-vs-virtual", virtual_virtual_table(report),
      report.lattice_has_gaps_filled
          ? "Simulations are compared at all marks of the lattice, the ones that were not measured "
            "included."
          : "Simulations are compared at the measured marks.");
  add("trust", trust_table(input, headline),
      "± is what the measurement leaves open; the interval is what other marks on the same cloth "
      "might have given (2,000 bootstrap resamples). The rigid move is shown to judge placement; "
      "no other number uses it.");
  add("direction", direction_table(input, report),
      "Real minus virtual along the warp tangent, the weft tangent and the normal (out of the "
      "printed side) of the virtual sheet. Where the cloth shears, the two tangents are not at "
      "right angles and the squares do not add up.");
  if (report.budget)
    add("budget", budget_table(*report.budget),
        "U is the half width that holds 95 of 100 means, the root of the sum of the squares of the "
        "lines with its coverage factor; each line is what its input alone moves. It holds no "
        "repeat of the real drape and no other equilibrium, and what friction leaves open only "
        "where an ensemble was made.");
  add("judged-by", basis_table(report));
  add("repeats", repeats_table(report));
  add("marks", mark_table(input, report));
  add("gaps", gap_table(input, report));
  add("strain", strain_table(headline),
      "Length of the straight line between neighbouring marks and area between four of them "
      "against the flat print; a fold between two marks makes it shorter.");
  add("drapemeter", drapemeter_table(input, report));
  add("hem", hem_table(input, report),
      "Fourier amplitudes of the radius of the hem's shadow over the angle; a square patch has its "
      "own 4, 8, 12.");
  add("folds", shape_table(input));
  add("waves", wave_table(input));
  add("certificates", certificate_table(input, report),
      "Options and curve fits are in the full certificate.json beside each simulated sheet, and in "
      "the store.");
  if (!drape.error_split) return tables;
  add("fabric-values", value_effect_table(*drape.error_split));
  add("model-changes", variant_effect_table(*drape.error_split),
      "drape simulate sensitivity drapes the scene once more and repeats it with one thing "
      "changed: from the drape itself, which keeps the branch, and from the start, which may end "
      "on another. The changes do not add up.");
  return tables;
}

}  // namespace drape::compare

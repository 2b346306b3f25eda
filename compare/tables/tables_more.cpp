// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/tables/tables.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::deg;
using units::mm;
using units::percent;

std::string fine_mm(const std::optional<double>& length_m) {
  return length_m ? fmt::format("{:.4f}", *length_m / mm) : std::string();
}

void add_trusted(Table& table, const std::string& name, double value_m, const Trust& trust) {
  table.add({name, mm_text(value_m), fine_mm(trust.sigma_m),
             trust.bootstrap ? mm_text(trust.bootstrap->low) : "",
             trust.bootstrap ? mm_text(trust.bootstrap->high) : ""});
}

void add_drapemeter(Table& table, const std::string& name, const DrapemeterResult& result) {
  if (!result.value) {
    table.add({name, "", "", "", "", "", result.reason});
    return;
  }
  const Drapemeter& d = *result.value;
  table.add({name, fmt::format("{:.0f}", d.covered_area_m2 / (mm * mm)),
             fmt::format("{:.1f}", d.covered_area_m2 / d.flat_area_m2 / percent),
             d.drape_coefficient ? fmt::format("{:.1f}", *d.drape_coefficient / percent) : "",
             std::to_string(d.folds), fmt::format("{:.1f}", d.fold_depth_m / mm),
             d.drape_coefficient ? "" : "no coefficient: the object has no flat top"});
}

}  // namespace

Table trust_table(const DrapeInput& input, const RealVirtual& row) {
  Table table;
  table.title = "Trust in the numbers, " + input.simulations[row.simulation].label();
  table.names = {"measure", "value_mm", "sigma_mm", "low_mm", "high_mm"};
  table.headings = {"measure", "value (mm)", "± from the marks (mm)", "95 % over marks, from (mm)",
                    "to (mm)"};
  table.numeric = {false, true, true, true, true};
  const DistanceStatistics& s = row.statistics;
  add_trusted(table, "mean (the paper's)", s.mean_m, s.mean);
  add_trusted(table, "median", s.median_m, s.median);
  add_trusted(table, "RMS", s.rms_m, s.rms);
  add_trusted(table, "95th percentile", s.p95_m, s.p95);
  add_trusted(table, "largest", s.max_m, s.max);
  add_trusted(table, "mean along the normal, signed", row.normal.mean_m, row.normal.mean);
  add_trusted(table, "mean to the nearest point of the surface", row.to_surface.mean_m,
              row.to_surface.mean);
  if (row.aligned) {
    add_trusted(table,
                fmt::format("mean left after one rigid move ({:.2f} mm, {:.2f} deg; not applied "
                            "anywhere else)",
                            row.aligned->centroid_shift_m / mm, row.aligned->turn_rad / deg),
                row.aligned->after.mean_m, row.aligned->after.mean);
  }
  return table;
}

Table surface_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.title = fmt::format(
      "Real vs surface, experiment {}: no material correspondence exists, so no mark has a place",
      report.name);
  table.names = {"simulator",
                 "to_surface_mean_mm",
                 "sigma_of_to_surface_mean_mm",
                 "to_surface_p95_mm",
                 "to_surface_max_mm",
                 "real_to_mesh_mean_mm",
                 "real_to_mesh_max_mm",
                 "mesh_to_real_mean_mm",
                 "mesh_to_real_max_mm",
                 "marks",
                 "triangles"};
  table.headings = {"mesh",           "marks to surface, mean (mm)",
                    "± (mm)",         "p95 (mm)",
                    "max (mm)",       "real surface to mesh, mean (mm)",
                    "Hausdorff (mm)", "mesh to real surface, mean (mm)",
                    "Hausdorff (mm)", "marks",
                    "triangles"};
  table.numeric.assign(table.names.size(), true);
  table.numeric.front() = false;
  for (const RealSurface& row : report.real_surface) {
    const OtherSurface& surface = input.surfaces[row.surface];
    const DistanceStatistics& s = row.to_surface;
    const auto one_direction = [&](OneDirection SurfaceDistance::*one,
                                   double OneDirection::*value) {
      return row.both_directions ? mm_text((*row.both_directions).*one.*value) : std::string();
    };
    table.add({surface.simulator, mm_text(s.mean_m), fine_mm(s.mean.sigma_m), mm_text(s.p95_m),
               mm_text(s.max_m),
               one_direction(&SurfaceDistance::first_to_second, &OneDirection::mean_m),
               one_direction(&SurfaceDistance::first_to_second, &OneDirection::hausdorff_m),
               one_direction(&SurfaceDistance::second_to_first, &OneDirection::mean_m),
               one_direction(&SurfaceDistance::second_to_first, &OneDirection::hausdorff_m),
               std::to_string(s.marks), std::to_string(surface.mesh.triangles.size())});
  }
  return table;
}

Table drapemeter_table(const DrapeInput& input, const Report& report) {
  Table table;
  table.title = "Drapemeter: the shadow from straight above";
  table.names = {"sheet",
                 "covered_area_mm2",
                 "covered_percent_of_flat",
                 "drape_coefficient_percent",
                 "folds",
                 "fold_depth_mm",
                 "remark"};
  table.headings = {"sheet",
                    "covered (mm²)",
                    "of the flat cloth (%)",
                    "drape coefficient (%)",
                    "folds",
                    "fold depth (mm)",
                    ""};
  table.numeric = {false, true, true, true, true, true, false};
  add_drapemeter(table, "measured marks", report.measured_drapemeter);
  for (const RealVirtual& row : report.real_virtual) {
    add_drapemeter(table, input.simulations[row.simulation].label(),
                   report.drapemeters[row.simulation]);
  }
  return table;
}

Table strain_table(const RealVirtual& row) {
  Table table;
  table.names = {"kind", "row", "col", "to_row", "to_col", "real_percent", "simulated_percent"};
  table.numeric = {false, true, true, true, true, true, true};
  const auto number = [](double ratio) { return fmt::format("{:.4f}", ratio / percent); };
  for (const EdgeStrain& e : row.strain.edges) {
    table.add({e.along_warp ? "warp" : "weft", std::to_string(e.from.row),
               std::to_string(e.from.col), std::to_string(e.to.row), std::to_string(e.to.col),
               number(e.real), number(e.simulated)});
  }
  for (const AreaStrain& c : row.strain.cells) {
    table.add({"area", std::to_string(c.corner.row), std::to_string(c.corner.col),
               std::to_string(c.corner.row + 1), std::to_string(c.corner.col + 1), number(c.real),
               number(c.simulated)});
  }
  return table;
}

}  // namespace drape::compare

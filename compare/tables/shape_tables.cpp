// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "compare/folds/folds.hpp"
#include "compare/tables/tables.hpp"
#include "core/units.hpp"

namespace drape::compare {
namespace {

using units::mm;

/// Visits the measured sheet and the simulations that are complete grids, with their shapes.
template <class Visit>
void visit_shapes(const DrapeInput& input, const Visit& visit) {
  if (const auto shape = shape_of(input.measured.sheet)) visit("measured marks", *shape);
  for (const Simulation& simulation : input.simulations)
    if (const auto shape = shape_of(simulation.sheet.sheet)) visit(simulation.label(), *shape);
}

}  // namespace

Table shape_table(const DrapeInput& input) {
  Table table;
  table.title = "Folds and waves";
  table.names = {"sheet"};
  for (const Descriptor& one : descriptors_of({})) table.names.push_back(one.name);
  table.headings = {"sheet", "RMS curvature (1/m)", "height, sd (mm)", "wavelength (mm)",
                    "folds", "length of folds (mm)"};
  table.numeric.assign(table.names.size(), true);
  table.numeric.front() = false;
  visit_shapes(input, [&](const std::string& label, const SheetShape& shape) {
    std::vector<std::string> row = {label};
    for (const Descriptor& one : descriptors_of(shape))
      row.push_back(fmt::format("{:.5g}", one.value));
    table.add(std::move(row));
  });
  return table;
}

Table wave_table(const DrapeInput& input) {
  Table table({"sheet", "from_mm", "to_mm", "height_mm2", "curvature_per_m2"}, {1, 2, 3, 4});
  visit_shapes(input, [&](const std::string& label, const SheetShape& shape) {
    for (const WaveBand& band : shape.bands)
      table.add({label, fmt::format("{:.5g}", band.from_m / mm),
                 fmt::format("{:.5g}", band.to_m / mm),
                 fmt::format("{:.5g}", band.height_m2 / (mm * mm)),
                 fmt::format("{:.5g}", band.curvature_per_m2)});
  });
  return table;
}

}  // namespace drape::compare

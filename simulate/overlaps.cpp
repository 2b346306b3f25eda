// SPDX-License-Identifier: Apache-2.0
#include "simulate/overlaps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.hpp"
#include "simulate/contact/piercing.hpp"
#include "simulate/contact/self_distance.hpp"
#include "simulate/equilibrium/mixture.hpp"
#include "simulate/start/clamps.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

// m; a particle deeper than this in an object is no result, cloth between particles a warning
constexpr double kSunk = 0.1e-3;
constexpr double kThrough = 0.25;  // of a body's thickness; deeper is through its middle
constexpr double kTurned_rad = 45 * units::deg;  // a half triple beyond it bends like no curve

}  // namespace

void measure_gaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                  SimulateReport& report) {
  constexpr int kSamples = 8;  // per cell side
  report.least_gap_table_m = 1e9;
  report.least_gap_object_m.reset();
  report.deepest_between_m = 0;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    double least = 1e9;
    for (int i = 0; i < grid.count(); ++i) {
      if (grid.cells_at(i / grid.cols, i % grid.cols) == 0) continue;
      least = std::min(least, surroundings.gap_m(shape, at(position, i)));
    }
    if (surroundings.is_table(shape)) {
      report.least_gap_table_m = std::min(report.least_gap_table_m, least);
    } else {
      report.least_gap_object_m = std::min(report.least_gap_object_m.value_or(1e9), least);
    }
    for (int cell = 0; cell < grid.count(); ++cell) {
      if (!grid.has_cell(cell / grid.cols, cell % grid.cols)) continue;
      const Vector3d a = at(position, cell), b = at(position, cell + 1);
      const Vector3d c = at(position, cell + grid.cols);
      const Vector3d d = at(position, cell + grid.cols + 1);
      for (int k = 0; k <= kSamples * (kSamples + 2); ++k) {
        const int across = k / (kSamples + 1);
        const int along = k % (kSamples + 1);
        const double u = across / static_cast<double>(kSamples);
        const double v = along / static_cast<double>(kSamples);
        const Vector3d p = (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d);
        report.deepest_between_m =
            std::max(report.deepest_between_m, -surroundings.gap_m(shape, p));
      }
    }
  }
}

void judge_overlaps(const GridSpec& grid, const Surroundings& surroundings, const Field& position,
                    const SimulateOptions& options, SimulateReport& report) {
  // A cell of straight lines lies inside a round body by its width squared over four radii, so what
  // a coarse grid cannot follow is measured by the grid.
  const double spacing_m = std::max(grid.warp_spacing_m(), grid.weft_spacing_m());
  report.penetration_tolerance_m =
      std::max(options.penetration_tolerance_m, options.penetration_fraction * spacing_m);
  if (report.status == RestStatus::diverged) return;
  const SelfDistance self = self_distance(grid, position);
  report.least_self_distance_m = self.least_m;
  report.self_crossings = self.crossings;
  std::string fault;
  const double depth_m =
      -std::min(report.least_gap_table_m, report.least_gap_object_m.value_or(0.0));
  if (depth_m > kSunk) fault = fmt::format("{:.2g} mm inside an object or the table", depth_m / mm);
  if (report.deepest_between_m > report.penetration_tolerance_m) {
    fault = fmt::format("between its particles {:.2g} mm inside an object",
                        report.deepest_between_m / mm);
  } else if (report.deepest_between_m > kSunk) {
    report.warnings.push_back(
        fmt::format("between its particles the sheet reaches {:.2f} mm into an object",
                    report.deepest_between_m / mm));
  }
  // Such a contact sinks in by 2 um per particle's weight: one that is jammed so deep is no rest.
  if (report.deepest_edge_m > kSunk)
    fault = fmt::format("with an edge or corner of an object {:.2g} mm deep in it",
                        report.deepest_edge_m / mm);
  const double through = through_part(grid, position, surroundings);
  if (through > kThrough)
    fault = fmt::format("passing through an object, {:.0f} % of its thickness deep", 100 * through);
  report.pierced_m = std::max(pierced_m(grid, position, surroundings),
                              rim_through_m(grid, position, surroundings));
  if (report.pierced_m > report.penetration_tolerance_m)
    fault = fmt::format("pierced: an edge of an object stands {:.2g} mm through it",
                        report.pierced_m / mm);
  if (self.crossings > 0)
    fault = fmt::format("passing through itself in {} pairs of triangles", self.crossings);
  if (fault.empty()) return;
  if (report.status == RestStatus::at_rest) {
    report.status = RestStatus::penetrates;
    report.sentence = fmt::format("still, but {}, after {} steps", fault, report.steps);
  } else {
    report.warnings.push_back("the sheet is " + fault);
  }
}

void judge_clamps(const Scene& scene, const GridSpec& grid, const Sheet& sheet,
                  SimulateReport& report) {
  if (sheet.marks.size() != static_cast<std::size_t>(grid.count())) return;
  double most_rad = 0;
  for (const ClampedPlace& place : clamps_on(scene, grid).places) {
    const Vector3d edge =
        sheet.marks[place.next].point_in_world - sheet.marks[place.held].point_in_world;
    most_rad =
        std::max(most_rad, std::atan2(std::abs(edge.dot(place.normal)), edge.dot(place.forward)));
  }
  if (most_rad > kTurned_rad)
    report.warnings.push_back(
        fmt::format("the cloth leaves a clamp at {:.0f} degrees to its direction within one grid "
                    "spacing: the bend there is unresolved; give a finer grid",
                    most_rad / units::deg));
}

}  // namespace drape::simulate

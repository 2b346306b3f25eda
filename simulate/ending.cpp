// SPDX-License-Identifier: Apache-2.0
#include "simulate/ending.hpp"

#include <fmt/format.h>

#include "core/units.hpp"

namespace drape {

using units::mm;

Ending ending_of(const SimulateResult& result, const std::filesystem::path& out) {
  const SimulateReport& report = result.report;
  Ending ending;
  ending.go = report.status == RestStatus::at_rest;
  ending.verdict =
      fmt::format("{}x{} particles {} after {:.2f} s of motion ({} steps)", result.sheet.rows,
                  result.sheet.cols, report.sentence, report.time_s, report.steps);
  ending.numbers = {
      {"largest residual force", fmt::format("{:.2g} of a particle's weight", report.residual)},
      {"strain warp, weft",
       fmt::format("{:.2f} to {:.2f} %, {:.2f} to {:.2f} %", 1e2 * report.strains.warp_least,
                   1e2 * report.strains.warp_most, 1e2 * report.strains.weft_least,
                   1e2 * report.strains.weft_most)},
      {"deepest between particles", fmt::format("{:.3f} mm", report.deepest_between_m / mm)},
      {"particles touching", fmt::format("{}", report.contacts)}};
  ending.rejected = report.warnings;
  ending.next_command = fmt::format(
      "drape-compare MEASURED.ply {} --calibration FILE --store results.sqlite --report "
      "report.html",
      (out / "sheet.ply").string());
  return ending;
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "simulate/programs/ending.hpp"

#include <fmt/format.h>

#include "core/error.hpp"
#include "core/program/shell_word.hpp"
#include "core/units.hpp"
#include "simulate/objects/surroundings.hpp"
#include "simulate/programs/foundation.hpp"

namespace drape::simulate {

using units::mm;

Ending ending_of(const SimulateResult& result, const std::filesystem::path& out) {
  const SimulateReport& report = result.report;
  Ending ending;
  ending.go = report.status == RestStatus::at_rest;
  ending.verdict =
      fmt::format("{}x{} particles {} after {:.2f} s of motion ({} steps)", result.sheet.rows,
                  result.sheet.cols, report.sentence, report.time_s, report.steps);
  ending = resting_on(result.sheet.no_go, std::move(ending));
  ending.numbers = {
      {"largest residual force", fmt::format("{:.2g} of a particle's weight", report.residual)},
      {"strain warp, weft",
       fmt::format("{:.2f} to {:.2f} %, {:.2f} to {:.2f} %", 1e2 * report.strains.warp_least,
                   1e2 * report.strains.warp_most, 1e2 * report.strains.weft_least,
                   1e2 * report.strains.weft_most)},
      {"deepest between particles", fmt::format("{:.3f} mm", report.deepest_between_m / mm)},
      {"particles touching", fmt::format("{}", report.contacts)}};
  if (report.check) {
    ending.numbers.emplace_back(
        "independent check",
        report.check->accepted
            ? fmt::format("accepted, {:.2g} of a particle's weight left", report.check->residual)
            : "refused");
  }
  if (report.drape_coefficient) {
    ending.numbers.emplace_back("drape coefficient",
                                fmt::format("{:.1f} %", 1e2 * *report.drape_coefficient));
  }
  ending.warnings = report.warnings;
  if (report.check) ending.rejected = report.check->refused;
  ending.next_command = fmt::format(
      "drape-compare MEASURED.ply {} --calibration FILE --store results.sqlite --report "
      "report.html",
      shell_word((out / "sheet.ply").string()));
  return ending;
}

Ending objects_read(const std::filesystem::path& scene) {
  if (scene.empty()) throw usage_error("SCENE is missing", "give a scene.toml");
  const Surroundings around(read_scene(scene));
  Ending ending;
  ending.verdict = fmt::format("table and objects are read, {} together", around.count());
  return ending;
}

void require_scene_and_out(const std::filesystem::path& scene, const std::filesystem::path& out) {
  if (scene.empty() || out.empty()) throw usage_error("SCENE or --out is missing", "give both");
}

}  // namespace drape::simulate

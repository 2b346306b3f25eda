// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/units.hpp"
#include "simulate/checker/certify.hpp"
#include "simulate/simulate.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {

/// Options of a drape on one mesh of 10 mm, with one line per curve.
[[nodiscard]] inline SimulateOptions coarse_options() {
  SimulateOptions options;
  options.segments = 1;
  options.drape.spacing_m = options.drape.coarsest_m = 10 * units::mm;
  return options;
}

/// A drape of rigs/paper with everything needed to judge it.
struct Case {
  explicit Case(const std::string& name, SimulateOptions how = coarse_options())
      : scene(read_scene(test::source_root() / "rigs/paper/scenes" / (name + ".toml"))),
        fabric(read_fabric(scene.fabric_file)),
        print(read_print(scene.print_file)),
        options(std::move(how)) {}
  /// Computes the drape, writes its files and reads them back.
  void drape() {
    result = simulate(scene, fabric, print, std::nullopt, options);
    const test::TemporaryFolder folder;
    RunRecord record("test", {}, folder.path() / "run.json");
    write_outputs(folder.path(), result, record);
    files = read_rest_files(folder.path());
  }
  [[nodiscard]] CertifyReport judge() const { return certify(files, scene, fabric, print); }

  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
  SimulateResult result;
  RestFiles files;
};

/// The lines that fail, and the refusals.
[[nodiscard]] inline std::string listed(const CertifyReport& report) {
  std::string text;
  for (const CertifyLine& line : report.lines)
    if (!line.passes())
      text += line.what + ": found " + std::to_string(line.found) + " claimed " +
              std::to_string(line.claimed) + " allowed " + std::to_string(line.allowed) + "\n";
  for (const std::string& refusal : report.refusals) text += refusal + "\n";
  return text;
}

}  // namespace drape::simulate

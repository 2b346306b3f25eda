// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/checker/certify.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {

/// A drape of rigs/paper at rest and all that is needed to judge it.
struct Case {
  Case(const std::string& name, const SimulateOptions& how)
      : scene(read_scene(test::source_root() / "rigs/paper/scenes" / (name + ".toml"))),
        fabric(read_fabric(scene.fabric_file)),
        print(read_print(scene.print_file)),
        options(how) {
    options.rows = options.cols = 11;
    drape();
  }
  Case(const std::string& name, ClothModel model) : Case(name, SimulateOptions{.model = model}) {}
  /// Once more, after a change of what it is made of.
  void drape() {
    result = simulate(scene, fabric, print, std::nullopt, options);
    claim = claim_of(result, options);
  }
  [[nodiscard]] CertifyReport judge() const {
    return certify(result.sheet, scene, fabric, print, claim);
  }

  Scene scene;
  Fabric fabric;
  Print print;
  SimulateOptions options;
  SimulateResult result;
  CertificateClaim claim;
};

inline std::string listed(const CertifyReport& report) {
  std::string text;
  for (const CertifyLine& line : report.lines) {
    if (!line.passes())
      text += line.what + ": found " + std::to_string(line.found) + " claimed " +
              std::to_string(line.claimed) + " allowed " + std::to_string(line.allowed) + "\n";
  }
  for (const std::string& refusal : report.refusals) text += refusal + "\n";
  return text;
}

}  // namespace drape::simulate

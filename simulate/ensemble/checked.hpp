// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "simulate/checker/certify.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

/// simulate(), then judge_rest().
[[nodiscard]] inline SimulateResult simulate_checked(const Scene& scene, const Fabric& fabric,
                                                     const Print& print,
                                                     const std::optional<Sheet>& measured,
                                                     const SimulateOptions& options) {
  SimulateResult result = simulate(scene, fabric, print, measured, options);
  judge_rest(result, scene, fabric, print, options);
  return result;
}

}  // namespace drape::simulate

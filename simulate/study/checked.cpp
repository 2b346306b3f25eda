// SPDX-License-Identifier: Apache-2.0
#include "simulate/study/checked.hpp"

#include "simulate/checker/certify.hpp"

namespace drape::simulate {

SimulateResult simulate_checked(const Scene& scene, const Fabric& fabric, const Print& print,
                                const std::optional<Sheet>& measured,
                                const SimulateOptions& options) {
  SimulateResult result = simulate(scene, fabric, print, measured, options);
  judge_rest(result, scene, fabric, print, options);
  return result;
}

}  // namespace drape::simulate

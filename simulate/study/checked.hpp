// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "simulate/simulate.hpp"

namespace drape::simulate {

/// simulate(), then judge_rest().
[[nodiscard]] SimulateResult simulate_checked(const Scene& scene, const Fabric& fabric,
                                              const Print& print,
                                              const std::optional<Sheet>& measured,
                                              const SimulateOptions& options);

}  // namespace drape::simulate

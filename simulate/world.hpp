// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/simulate.hpp"
#include "simulate/start/local_frame.hpp"

namespace drape::simulate {

/// Boundary of the specimen.
[[nodiscard]] double mass_kg(const Fabric& fabric, const Print& print,
                             const SimulateOptions& options);

/// Turns a result in the frame of `local` into one in the world.
void take_to_world(const LocalScene& local, double sheet_kg, SimulateResult& result);

}  // namespace drape::simulate

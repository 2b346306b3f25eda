// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// What is wrong with a sheet that a drape is to start from, in words; empty when nothing is. No
/// solver takes a sheet out of itself or off an edge that stands through it, so whoever starts
/// from such a sheet should know before the end is refused.
[[nodiscard]] std::vector<std::string> faults_of_start(const GridSpec& grid, const Field& position,
                                                       const Surroundings& surroundings);

/// What is to be said where particles were inside an object at the start.
[[nodiscard]] std::string warning_of_lifted(int particles);

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/cloth/cloth.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Sets particles inside an object on its surface; returns how many.
int lift_out(const Surroundings& surroundings, Field& position);

/// Bicubic interpolation of a sheet onto another grid of the same patch.
[[nodiscard]] Field prolong(const Field& coarse, const GridSpec& from, const GridSpec& to);

}  // namespace drape::simulate

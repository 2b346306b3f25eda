// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/statistics/random.hpp"

namespace drape::synth {

/// Mixes 64 bits. Random numbers are computed from an index, so that a pixel's noise does not
/// depend on the order of threads.
[[nodiscard]] inline std::uint64_t mixed(std::uint64_t bits) {
  return SplitMix64(bits).next();
}

/// Number `index` of the stream `seed`, uniform in [0, 1).
[[nodiscard]] inline double uniform(std::uint64_t seed, std::uint64_t index) {
  return static_cast<double>(mixed(mixed(seed) ^ index) >> 11U) * 0x1p-53;
}

/// Number `index` of the stream `seed`, standard normal (Box, Muller 1958).
[[nodiscard]] inline double normal(std::uint64_t seed, std::uint64_t index) {
  const double radius = std::sqrt(-2 * std::log(1 - uniform(seed, 2 * index)));
  return radius * std::cos(2 * std::numbers::pi * uniform(seed, 2 * index + 1));
}

}  // namespace drape::synth

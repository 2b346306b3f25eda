// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace drape {

/// SplitMix64 (Steele, Lea, Flood 2014): the same sequence with every library and on every machine.
class SplitMix64 {
 public:
  /// Starts the sequence of `seed` after its first `skipped` numbers.
  explicit SplitMix64(std::uint64_t seed, std::uint64_t skipped = 0)
      : state_(seed + skipped * kStep) {}
  /// 64 random bits.
  std::uint64_t next() {
    std::uint64_t z = (state_ += kStep);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }
  /// Uniform in 0 to count - 1, count <= 2^32, by the high word of a product.
  std::uint64_t below(std::uint64_t count) { return (next() >> 32) * count >> 32; }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  static constexpr std::uint64_t kStep = 0x9E3779B97F4A7C15;
  std::uint64_t state_;
};

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

#include "core/statistics/sample.hpp"

namespace drape::test {

/// Counts of the trials in which U held the true value, with the binomial 95 % interval.
struct Coverage {
  int inside = 0, all = 0;
  void add(bool held) {
    inside += held;
    ++all;
  }
  [[nodiscard]] double part() const { return inside / static_cast<double>(all); }
  [[nodiscard]] double least() const {
    return all > 0 ? 1 - probability_bound(all - inside, all, 0.975) : 0;
  }
  [[nodiscard]] double most() const { return all > 0 ? probability_bound(inside, all, 0.975) : 1; }
  [[nodiscard]] bool holds_95() const { return least() <= 0.95 && most() >= 0.95; }
  void print(const std::string& what) const {
    std::printf("  %s: %d of %d (%.1f to %.1f %%)\n", what.c_str(), inside, all, 100 * least(),
                100 * most());
  }
};

}  // namespace drape::test

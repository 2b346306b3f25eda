// SPDX-License-Identifier: Apache-2.0
#include "core/statistics/convergence.hpp"

#include <cmath>

namespace drape {

std::optional<double> order_of(const std::array<double, 3>& h, double ratio) {
  const auto ratio_of = [&](double p) {
    return (std::pow(h[2] / h[1], p) - 1) / (1 - std::pow(h[0] / h[1], p));
  };
  double low = kLeastOrder, high = kMostOrder;
  if (!(ratio >= ratio_of(low) && ratio <= ratio_of(high))) return std::nullopt;
  for (int k = 0; k < 60; ++k) {
    const double middle = 0.5 * (low + high);
    (ratio_of(middle) < ratio ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace drape

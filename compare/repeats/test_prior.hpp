// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/math/special_functions/digamma.hpp>
#include <boost/math/special_functions/trigamma.hpp>
#include <cmath>
#include <numeric>

#include "compare/repeats/repeats.hpp"

// Derivation of published_priors().
namespace drape::compare {

using boost::math::digamma;
using boost::math::trigamma;

/// Variance of one group of repeats.
struct GroupVariance {
  double variance = 0;
  int dof = 0;
};

/// From the moments of the log variance (Smyth 2004, section 6.2) of two or more groups.
inline VariancePrior variance_prior(const std::vector<GroupVariance>& groups) {
  std::vector<double> logs;
  double chance = 0;
  for (const GroupVariance& group : groups) {
    if (!(group.variance > 0) || group.dof < 1) continue;
    const double half = group.dof / 2.0;
    logs.push_back(std::log(group.variance) - digamma(half) + std::log(half));
    chance += trigamma(half);
  }
  const auto n = static_cast<double>(logs.size());
  const double mean = std::accumulate(logs.begin(), logs.end(), 0.0) / n;
  double squares = 0;
  for (const double log : logs) squares += (log - mean) * (log - mean);
  const double excess = squares / (n - 1) - chance / n;
  double low = 1e-3, high = 1e6;  // trigamma(dof / 2) decreases with dof
  for (int i = 0; i < 200; ++i) {
    const double middle = std::sqrt(low * high);
    (trigamma(middle / 2) > excess ? low : high) = middle;
  }
  return {low, std::exp(mean + digamma(low / 2) - std::log(low / 2))};
}

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "compare/metrics/metrics.hpp"

namespace drape::compare {

/// Number of resamples per interval, so that its ends are the 50th value from below and above.
inline constexpr int kResamples = 2000;

/// Sets the bootstrap intervals of mean, median, RMS, 95th percentile and maximum. The seed is
/// fixed, so equal distances give equal intervals. Marks are drawn as if independent; those of a
/// cloth are correlated, so the true interval is somewhat wider.
void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics);

/// Bootstrap interval of the mean of signed values. nullopt for fewer than two values.
[[nodiscard]] std::optional<Interval> bootstrap_of_mean(const std::vector<double>& values_m);

/// Sets the standard deviation of each statistic to first order, from independent sigmas in the
/// order of the distances; the gradient of an order statistic is the weight of each sorted value.
void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics);

}  // namespace drape::compare

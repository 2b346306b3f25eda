// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "compare/metrics/metrics.hpp"

namespace drape::compare {

/// Resamples per interval: the two ends then stand on the 50th value from below and above.
inline constexpr int kResamples = 2000;

/// Sets the bootstrap intervals of mean, median, RMS, 95th percentile and maximum. The draws have a
/// fixed start, so the same distances always give the same interval. Marks are drawn as if
/// independent; neighbours on a cloth are not, so the true interval is rather wider.
void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics);

/// The same for the mean of values of either sign. Nothing below two values.
[[nodiscard]] std::optional<Interval> bootstrap_of_mean(const std::vector<double>& values_m);

/// Sets one standard deviation of each statistic, to first order, from independent sigmas in the
/// order of the distances: the gradient of an order statistic is the weight of each sorted value.
void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics);

}  // namespace drape::compare

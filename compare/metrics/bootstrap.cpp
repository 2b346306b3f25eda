// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include "core/statistics/sample.hpp"

namespace drape::compare {
namespace {

/// Standard deviation of the quantile q of sorted values, by its weights on them.
double quantile_sigma(const std::vector<double>& sorted_sigmas, double q) {
  const QuantilePlace place = quantile_place(sorted_sigmas.size(), q);
  return std::hypot((1 - place.part) * sorted_sigmas[place.below],
                    place.part * sorted_sigmas[place.above]);
}

}  // namespace

void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics) {
  if (distances_m.size() < 2) return;
  std::vector<double> ascending = distances_m;
  std::sort(ascending.begin(), ascending.end());
  const auto n = static_cast<double>(ascending.size());
  std::vector<double> means, medians, roots, p95s, maxima;
  bootstrap(ascending.size(), kResamples, [&](std::span<const std::int64_t> counts) {
    double sum = 0, squares = 0, largest = 0;
    for (std::size_t i = 0; i < ascending.size(); ++i) {
      const auto count = static_cast<double>(counts[i]);
      sum += count * ascending[i];
      squares += count * ascending[i] * ascending[i];
      if (counts[i] > 0) largest = ascending[i];
    }
    means.push_back(sum / n);
    roots.push_back(std::sqrt(squares / n));
    medians.push_back(counted_quantile(counts, 0.5, ascending));
    p95s.push_back(counted_quantile(counts, 0.95, ascending));
    maxima.push_back(largest);
  });
  statistics.mean.bootstrap = percentile_interval(means);
  statistics.median.bootstrap = percentile_interval(medians);
  statistics.rms.bootstrap = percentile_interval(roots);
  statistics.p95.bootstrap = percentile_interval(p95s);
  statistics.max.bootstrap = percentile_interval(maxima);
}

std::optional<Interval> bootstrap_of_mean(const std::vector<double>& values_m) {
  if (values_m.size() < 2) return std::nullopt;
  std::vector<double> means;
  bootstrap(values_m.size(), kResamples, [&](std::span<const std::int64_t> counts) {
    double sum = 0;
    for (std::size_t i = 0; i < values_m.size(); ++i)
      sum += static_cast<double>(counts[i]) * values_m[i];
    means.push_back(sum / static_cast<double>(values_m.size()));
  });
  return percentile_interval(means);
}

void add_sigmas(const std::vector<double>& distances_m, const std::vector<double>& sigmas_m,
                DistanceStatistics& statistics) {
  std::vector<std::size_t> order(distances_m.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return distances_m[a] < distances_m[b]; });
  std::vector<double> sorted_sigmas;
  sorted_sigmas.reserve(order.size());
  for (const std::size_t i : order) sorted_sigmas.push_back(sigmas_m[i]);
  double variances = 0, weighted = 0;
  for (std::size_t i = 0; i < distances_m.size(); ++i) {
    variances += sigmas_m[i] * sigmas_m[i];
    weighted += std::pow(distances_m[i] * sigmas_m[i], 2);
  }
  const auto n = static_cast<double>(distances_m.size());
  statistics.mean.sigma_m = std::sqrt(variances) / n;
  // If all distances are zero the RMS has no gradient; its standard deviation is the RMS sigma.
  statistics.rms.sigma_m = statistics.rms_m > 0 ? std::sqrt(weighted) / (n * statistics.rms_m)
                                                : std::sqrt(variances / n);
  statistics.median.sigma_m = quantile_sigma(sorted_sigmas, 0.5);
  statistics.p95.sigma_m = quantile_sigma(sorted_sigmas, 0.95);
  statistics.max.sigma_m = sorted_sigmas.back();
}

}  // namespace drape::compare

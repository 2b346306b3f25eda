// SPDX-License-Identifier: Apache-2.0
#include "compare/metrics/bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "core/numbers/random.hpp"

namespace drape::compare {
namespace {

class Draws {
 public:
  /// Uniform in 0..count-1, by the high word of a product.
  std::size_t below(std::size_t count) {
    return static_cast<std::size_t>((random_.next() >> 32U) * count >> 32U);
  }

 private:
  SplitMix64 random_{0x6472617065};
};

Interval interval_of(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return {quantile(values, 0.025), quantile(values, 0.975)};
}

/// Order statistic q of a resample that holds ascending[i] counts[i] times.
double counted_quantile(const std::vector<double>& ascending, const std::vector<int>& counts,
                        double q) {
  const double position = q * static_cast<double>(ascending.size() - 1);
  const auto below = static_cast<int>(position);
  const double t = position - below;
  int seen = 0;
  for (std::size_t i = 0; i < ascending.size(); ++i) {
    seen += counts[i];
    if (seen <= below) continue;
    if (seen > below + 1 || t <= 0) return ascending[i];
    std::size_t next = i + 1;
    while (counts[next] == 0) ++next;
    return ascending[i] + t * (ascending[next] - ascending[i]);
  }
  return ascending.back();
}

/// Weights of the sorted values in the order statistic q, as (index, weight).
double quantile_sigma(const std::vector<double>& sorted_sigmas, double q) {
  const double position = q * static_cast<double>(sorted_sigmas.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted_sigmas.size() - 1);
  const double t = position - static_cast<double>(below);
  return std::hypot((1 - t) * sorted_sigmas[below], t * sorted_sigmas[above]);
}

}  // namespace

void add_bootstrap(const std::vector<double>& distances_m, DistanceStatistics& statistics) {
  if (distances_m.size() < 2) return;
  std::vector<double> ascending = distances_m;
  std::sort(ascending.begin(), ascending.end());
  const auto n = static_cast<double>(ascending.size());
  std::vector<double> means, medians, roots, p95s, maxima;
  std::vector<int> counts(ascending.size());
  Draws draws;
  for (int k = 0; k < kResamples; ++k) {
    std::fill(counts.begin(), counts.end(), 0);
    for (std::size_t i = 0; i < ascending.size(); ++i) ++counts[draws.below(ascending.size())];
    double sum = 0, squares = 0, largest = 0;
    for (std::size_t i = 0; i < ascending.size(); ++i) {
      sum += counts[i] * ascending[i];
      squares += counts[i] * ascending[i] * ascending[i];
      if (counts[i] > 0) largest = ascending[i];
    }
    means.push_back(sum / n);
    roots.push_back(std::sqrt(squares / n));
    medians.push_back(counted_quantile(ascending, counts, 0.5));
    p95s.push_back(counted_quantile(ascending, counts, 0.95));
    maxima.push_back(largest);
  }
  statistics.mean.bootstrap = interval_of(means);
  statistics.median.bootstrap = interval_of(medians);
  statistics.rms.bootstrap = interval_of(roots);
  statistics.p95.bootstrap = interval_of(p95s);
  statistics.max.bootstrap = interval_of(maxima);
}

std::optional<Interval> bootstrap_of_mean(const std::vector<double>& values_m) {
  if (values_m.size() < 2) return std::nullopt;
  std::vector<double> means;
  Draws draws;
  for (int k = 0; k < kResamples; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < values_m.size(); ++i) sum += values_m[draws.below(values_m.size())];
    means.push_back(sum / static_cast<double>(values_m.size()));
  }
  return interval_of(means);
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
  // Where every distance is zero the RMS has no gradient; its noise is then the RMS sigma.
  statistics.rms.sigma_m = statistics.rms_m > 0 ? std::sqrt(weighted) / (n * statistics.rms_m)
                                                : std::sqrt(variances / n);
  statistics.median.sigma_m = quantile_sigma(sorted_sigmas, 0.5);
  statistics.p95.sigma_m = quantile_sigma(sorted_sigmas, 0.95);
  statistics.max.sigma_m = sorted_sigmas.back();
}

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace drape {

// Distributions from Boost.Math, which is compiled here only. Degrees of freedom must be positive
// and need not be whole.

/// Quantile of the standard normal distribution, 0 < p < 1.
[[nodiscard]] double normal_quantile(double p);

/// Cumulative distribution function of Student's t.
[[nodiscard]] double student_cdf(double t, double dof);
/// Quantile of Student's t, 0 < p < 1.
[[nodiscard]] double student_quantile(double p, double dof);

/// Probability that a chi-square variable exceeds `chi2`; 1 for chi2 <= 0.
[[nodiscard]] double chi_square_tail(double chi2, double dof);
/// The value that a chi-square variable exceeds with probability p, 0 < p < 1.
[[nodiscard]] double chi_square_beyond(double p, double dof);

/// Probability that a variable with Fisher's F distribution exceeds `f`; 1 for f <= 0.
[[nodiscard]] double f_tail(double f, double numerator_dof, double denominator_dof);

/// Upper confidence bound of the probability of an event that occurred in `seen` of `trials` > 0
/// trials (Clopper and Pearson 1934); about 3 / trials at 95 % if it never occurred (the rule of
/// three).
[[nodiscard]] double probability_bound(int seen, int trials, double confidence);

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

/// The value at index `place` of the sorted sample, which holds more than `place` values.
template <typename T>
[[nodiscard]] T order_statistic(std::vector<T> values, std::size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// High median of at least one value: always an element of the sample, the upper of the two middle
/// ones for an even count. For use in estimators; report quantile(values, 0.5) instead.
template <typename T>
[[nodiscard]] T median(std::vector<T> values) {
  const std::size_t middle = values.size() / 2;
  return order_statistic(std::move(values), middle);
}

/// Median of the Rayleigh distribution of scale 1, sqrt(2 ln 2): the median distance in a plane per
/// standard deviation along one axis.
inline constexpr double kRayleighMedian = 1.1774;

/// Order statistics between which a quantile lies, and the fraction of the way between them.
struct QuantilePlace {
  std::size_t below = 0, above = 0;
  double part = 0;

  [[nodiscard]] double between(double low, double high) const { return low + part * (high - low); }
};

/// Position of the quantile p, 0 to 1, among `count` > 0 values by type 7 of Hyndman and Fan
/// (1996): linear interpolation between order statistics at p (count - 1), counted from 0. Every
/// quantile in drapebench is of this type.
[[nodiscard]] QuantilePlace quantile_place(std::size_t count, double p);

/// Quantile p of at least one value.
template <typename T>
[[nodiscard]] double quantile(std::vector<T> values, double p) {
  const QuantilePlace place = quantile_place(values.size(), p);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place.below);
  std::nth_element(values.begin(), at, values.end());
  const auto next = place.above > place.below ? std::min_element(at + 1, values.end()) : at;
  return place.between(static_cast<double>(*at), static_cast<double>(*next));
}

/// Quantile p of a sample in which ascending[i] occurs counts[i] times; 0 if it is empty. Without
/// `ascending`, the values are the indices i.
[[nodiscard]] double counted_quantile(std::span<const std::int64_t> counts, double p,
                                      std::span<const double> ascending = {});

[[nodiscard]] double mean_of(std::span<const double> values);

/// Sum of squared deviations from the mean, of at least one value.
[[nodiscard]] double squares_about_mean(std::span<const double> values);

struct Interval {
  double low = 0, high = 0;
};

/// Visits `draws` bootstrap resamples of `units` units with replacement (Efron 1979), each as the
/// number of draws of every unit. The seed is fixed: every call draws the same.
void bootstrap(std::size_t units, int draws,
               const std::function<void(std::span<const std::int64_t> counts)>& visit);

/// Quantiles 0.025 and 0.975 of a statistic over all resamples: its 95 % interval.
[[nodiscard]] Interval percentile_interval(const std::vector<double>& statistic);

}  // namespace drape

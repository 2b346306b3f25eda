// SPDX-License-Identifier: Apache-2.0
#include "core/statistics/sample.hpp"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <numeric>

namespace drape {

namespace bm = boost::math;

double normal_quantile(double p) {
  return bm::quantile(bm::normal(), p);
}

double student_cdf(double t, double dof) {
  return bm::cdf(bm::students_t(dof), t);
}

double student_quantile(double p, double dof) {
  return bm::quantile(bm::students_t(dof), p);
}

double chi_square_tail(double chi2, double dof) {
  return chi2 > 0 ? bm::cdf(bm::complement(bm::chi_squared(dof), chi2)) : 1;
}

double chi_square_beyond(double p, double dof) {
  return bm::quantile(bm::complement(bm::chi_squared(dof), p));
}

double f_tail(double f, double numerator_dof, double denominator_dof) {
  if (!(f > 0)) return 1;
  return bm::cdf(bm::complement(bm::fisher_f(numerator_dof, denominator_dof), f));
}

double probability_bound(int seen, int trials, double confidence) {
  if (seen >= trials) return 1;
  return bm::binomial::find_upper_bound_on_p(trials, seen, 1 - confidence);
}

QuantilePlace quantile_place(std::size_t count, double p) {
  const double position = p * static_cast<double>(count - 1);
  const auto below = static_cast<std::size_t>(position);
  return {below, std::min(below + 1, count - 1), position - static_cast<double>(below)};
}

double counted_quantile(std::span<const std::int64_t> counts, double p,
                        std::span<const double> ascending) {
  const auto total = std::accumulate(counts.begin(), counts.end(), std::int64_t{0});
  if (total == 0) return 0;
  const QuantilePlace place = quantile_place(static_cast<std::size_t>(total), p);
  const auto element = [&](std::size_t wanted) {
    std::size_t i = 0, seen = static_cast<std::size_t>(counts[0]);
    while (seen <= wanted) seen += static_cast<std::size_t>(counts[++i]);
    return ascending.empty() ? static_cast<double>(i) : ascending[i];
  };
  return place.between(element(place.below), element(place.above));
}

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double squares_about_mean(std::span<const double> values) {
  const double middle = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - middle) * (value - middle);
  return sum;
}

void bootstrap(std::size_t units, int draws,
               const std::function<void(std::span<const std::int64_t> counts)>& visit) {
  SplitMix64 random(0x6472617065);
  std::vector<std::int64_t> counts(units);
  for (int draw = 0; draw < draws; ++draw) {
    std::fill(counts.begin(), counts.end(), 0);
    for (std::size_t i = 0; i < units; ++i) ++counts[random.below(units)];
    visit(counts);
  }
}

Interval percentile_interval(const std::vector<double>& statistic) {
  return {quantile(statistic, 0.025), quantile(statistic, 0.975)};
}

}  // namespace drape

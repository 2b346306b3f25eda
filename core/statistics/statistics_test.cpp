// SPDX-License-Identifier: Apache-2.0
// Compares distributions with published tables, and quantiles with R's type 7.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/statistics/sample.hpp"

namespace drape {
namespace {

TEST(Distributions, EqualPublishedTables) {
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-14);
  EXPECT_NEAR(student_quantile(0.975, 1), 12.7062047362, 1e-8);
  EXPECT_NEAR(student_quantile(0.975, 10), 2.22813885196, 1e-9);
  EXPECT_NEAR(student_quantile(0.05, 4.5), -student_quantile(0.95, 4.5), 1e-12);
  EXPECT_NEAR(student_cdf(1.96, 1e6), 0.9750021, 1e-6);
  EXPECT_NEAR(f_tail(4.9646027437, 1, 10), 0.05, 1e-9);
  EXPECT_NEAR(f_tail(2.9782370160, 10, 10), 0.05, 1e-9);
  EXPECT_NEAR(f_tail(3.3258, 5, 10), 0.05, 1e-5);
  EXPECT_NEAR(f_tail(6.6349, 1, 1e7), 0.01, 1e-5);  // chi-square with one degree
  EXPECT_NEAR(f_tail(1, 7, 7), 0.5, 1e-12);
  EXPECT_EQ(f_tail(0, 3, 4), 1);
  EXPECT_LT(f_tail(1e6, 6, 60), 1e-100);
  for (const auto& [dof, chi2] : {std::pair(1, 7.879), {3, 12.838}, {5, 16.750}}) {
    EXPECT_NEAR(chi_square_beyond(0.005, dof), chi2, 5e-4);
    EXPECT_NEAR(chi_square_tail(chi_square_beyond(0.005, dof), dof), 0.005, 1e-12);
  }
  EXPECT_EQ(chi_square_tail(0, 2), 1);
}

TEST(Quantile, IsHyndmanAndFansTypeSeven) {
  const std::vector<double> values = {4, 1, 10, 2};  // R: quantile(c(4, 1, 10, 2), ...)
  for (const auto& [p, expected] :
       {std::pair(0.0, 1.0), {0.1, 1.3}, {0.5, 3}, {0.95, 9.1}, {1, 10}})
    EXPECT_NEAR(quantile(values, p), expected, 1e-12) << p;
  EXPECT_EQ(median(values), 4);
  EXPECT_EQ(quantile(std::vector<float>{7}, 0.3), 7);
}

TEST(Quantile, CountedValuesGiveThatOfTheValues) {
  const std::array<std::int64_t, 5> counts = {2, 0, 1, 3, 0};
  const std::array<double, 5> ascending = {1, 2, 4, 7, 9};
  const std::vector<double> all = {1, 1, 4, 7, 7, 7}, levels = {0, 0, 2, 3, 3, 3};
  for (const double p : {0.0, 0.1, 0.35, 0.5, 0.9, 1.0}) {
    EXPECT_EQ(counted_quantile(counts, p, ascending), quantile(all, p)) << p;
    EXPECT_EQ(counted_quantile(counts, p), quantile(levels, p)) << p;
  }
  EXPECT_EQ(counted_quantile({}, 0.5), 0);
}

TEST(Bootstrap, DrawsEveryUnitEvenlyAndTheSameEveryTime) {
  std::vector<double> firsts, again;
  bootstrap(10, 4000, [&](std::span<const std::int64_t> counts) {
    std::int64_t all = 0;
    for (const std::int64_t count : counts) all += count;
    ASSERT_EQ(all, 10);
    firsts.push_back(static_cast<double>(counts[0]));
  });
  bootstrap(10, 4000, [&](std::span<const std::int64_t> counts) {
    again.push_back(static_cast<double>(counts[0]));
  });
  EXPECT_EQ(firsts, again);
  EXPECT_NEAR(mean_of(firsts), 1, 4 * std::sqrt(0.9 / 4000));
  EXPECT_NEAR(squares_about_mean(firsts) / 4000, 0.9, 0.1);
  const Interval interval = percentile_interval(firsts);
  EXPECT_EQ(interval.low, 0);
  EXPECT_EQ(interval.high, 3);
}

}  // namespace
}  // namespace drape

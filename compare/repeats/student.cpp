// SPDX-License-Identifier: Apache-2.0
#include "compare/repeats/student.hpp"

#include <cmath>

namespace drape::compare {
namespace {

constexpr double kTiny = 1e-300;
constexpr double kEnough = 1e-14;
constexpr int kMostTerms = 10000;

/// Continued fraction of the incomplete beta function, modified Lentz.
double beta_fraction(double x, double a, double b) {
  const auto guarded = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double c = 1, d = 1 / guarded(1 - (a + b) * x / (a + 1)), result = d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / guarded(1 + even * d);
    c = guarded(1 + even / c);
    result *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / guarded(1 + odd * d);
    c = guarded(1 + odd / c);
    result *= d * c;
    if (std::abs(d * c - 1) < kEnough) break;
  }
  return result;
}

double incomplete_beta(double x, double a, double b) {
  if (x <= 0) return 0;
  if (x >= 1) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1) / (a + b + 2)) return front * beta_fraction(x, a, b) / a;
  return 1 - front * beta_fraction(1 - x, b, a) / b;
}

}  // namespace

double student_cdf(double t, double dof) {
  const double tail = incomplete_beta(dof / (dof + t * t), dof / 2, 0.5) / 2;
  return t > 0 ? 1 - tail : tail;
}

double f_tail(double f, double above, double below) {
  return f <= 0 ? 1 : incomplete_beta(below / (below + above * f), below / 2, above / 2);
}

double student_quantile(double p, double dof) {
  double low = -1, high = 1;
  while (student_cdf(low, dof) > p) low *= 2;
  while (student_cdf(high, dof) < p) high *= 2;
  for (int i = 0; i < 200 && high - low > kEnough * (1 + std::abs(low)); ++i) {
    const double middle = (low + high) / 2;
    (student_cdf(middle, dof) < p ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace drape::compare

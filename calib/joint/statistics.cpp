// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace drape::calib {
namespace {

/// Continued fraction of the incomplete beta function (Abramowitz and Stegun 26.5.8, by Lentz).
double beta_fraction(double x, double a, double b) {
  constexpr double kTiny = 1e-300;
  double c = 1, d = 1 / std::max(std::abs(1 - (a + b) * x / (a + 1)), kTiny), value = d;
  for (int m = 1; m < 300; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / (1 + even * d + kTiny);
    c = 1 + even / c + kTiny;
    value *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / (1 + odd * d + kTiny);
    c = 1 + odd / c + kTiny;
    const double step = d * c;
    value *= step;
    if (std::abs(step - 1) < 1e-14) break;
  }
  return value;
}

double incomplete_beta(double x, double a, double b) {
  if (!(x > 0)) return 0;
  if (!(x < 1)) return 1;
  const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                a * std::log(x) + b * std::log1p(-x));
  return x < (a + 1) / (a + b + 2) ? front * beta_fraction(x, a, b) / a
                                   : 1 - front * beta_fraction(1 - x, b, a) / b;
}

}  // namespace

double f_tail(double f, double numerator_dof, double denominator_dof) {
  if (!(f > 0)) return 1;
  return incomplete_beta(denominator_dof / (denominator_dof + numerator_dof * f),
                         denominator_dof / 2, numerator_dof / 2);
}

double widening_by_student(double degrees_of_freedom) {
  // Cornish-Fisher expansion (Abramowitz and Stegun 26.7.5), good to 1 % from 2 degrees on.
  const double z2 = 1.959964 * 1.959964, n = std::max(degrees_of_freedom, 2.0);
  return 1 + (z2 + 1) / (4 * n) + ((5 * z2 + 16) * z2 + 3) / (96 * n * n) +
         (((3 * z2 + 19) * z2 + 17) * z2 - 15) / (384 * n * n * n) +
         ((((79 * z2 + 776) * z2 + 1482) * z2 - 1920) * z2 - 945) / (92160 * n * n * n * n);
}

}  // namespace drape::calib

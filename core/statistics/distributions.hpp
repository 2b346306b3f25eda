// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distributions, by Boost.Math, which is compiled here alone. Degrees of freedom are above 0 and
// need not be whole.
namespace drape {

/// The z below which a standard normal variable lies with probability p, 0 < p < 1.
[[nodiscard]] double normal_quantile(double p);

/// Probability that Student's t lies below `t`.
[[nodiscard]] double student_cdf(double t, double dof);
/// The t below which that probability is p, 0 < p < 1.
[[nodiscard]] double student_quantile(double p, double dof);

/// Probability that a chi-square is larger; 1 for chi2 <= 0.
[[nodiscard]] double chi_square_tail(double chi2, double dof);
/// The chi-square that is exceeded with probability p, 0 < p < 1.
[[nodiscard]] double chi_square_beyond(double p, double dof);

/// Probability that Fisher's F is larger; 1 for f <= 0.
[[nodiscard]] double f_tail(double f, double numerator_dof, double denominator_dof);

/// Upper bound, at this confidence, of the probability of an event that `seen` of `trials` > 0
/// trials showed (Clopper and Pearson 1934); about 3 / trials at 95 % where none did (the rule of
/// three).
[[nodiscard]] double probability_bound(int seen, int trials, double confidence);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

// Distributions from Boost.Math, which is compiled here only. Degrees of freedom must be positive
// and need not be whole.
namespace drape {

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

}  // namespace drape

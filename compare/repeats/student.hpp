// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::compare {

/// Probability that Student's t with `dof` > 0 degrees of freedom lies below `t`. By the continued
/// fraction of the incomplete beta function (Abramowitz and Stegun 26.5.8, 26.7.1); 1e-12.
[[nodiscard]] double student_cdf(double t, double dof);

/// The t below which that probability is `p`, 0 < p < 1.
[[nodiscard]] double student_quantile(double p, double dof);

/// Probability that an F of `above` and `below` > 0 degrees of freedom lies above `f` (Abramowitz
/// and Stegun 26.6.2).
[[nodiscard]] double f_tail(double f, double above, double below);

}  // namespace drape::compare

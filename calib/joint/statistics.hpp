// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace drape::calib {

/// Probability that Fisher's F with these degrees of freedom is larger (0 to 1).
[[nodiscard]] double f_tail(double f, double numerator_dof, double denominator_dof);

/// The 97.5 % point of Student's t over that of the normal distribution: standard deviations that
/// are estimated with few degrees of freedom are widened by it, so that +-1.96 of them hold 95 %.
[[nodiscard]] double widening_by_student(double degrees_of_freedom);

}  // namespace drape::calib

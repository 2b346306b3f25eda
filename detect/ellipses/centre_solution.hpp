// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "detect/ellipses/blurred_ellipse.hpp"

namespace drape::detect {

/// The centre's part of the solution of normal equations.
struct CentreSolution {
  Eigen::Vector2d step;        ///< of the centre
  Eigen::Matrix2d covariance;  ///< of the centre: its block of the inverse
};

/// Solves `hessian` x = `gradient` for the centre alone: Cholesky's factor with the centre last
/// gives both without the other parameters. Nothing when the matrix is not positive definite.
[[nodiscard]] std::optional<CentreSolution> solve_for_centre(
    const BlurredEllipse::Matrix& hessian, const BlurredEllipse::Vector& gradient);

}  // namespace drape::detect

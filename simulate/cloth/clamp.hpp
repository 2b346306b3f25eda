// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "simulate/cloth/cloth.hpp"

namespace drape::simulate {

/// The half triple of a clamped place (see Cloth::clamp) at positions x.
struct ClampedBend {
  ClampedBend(const Cloth& cloth, const ClampedPlace& place, const Field& x);

  double scale_m2 = 0;         ///< energy over that of the bending law per area
  double curvature_per_m = 0;  ///< not negative
  double square_m2 = 0;        ///< g = 2 r (r - a), of which the curvature is 2 sqrt(g) / spacing^2
  Eigen::Vector3d of_next;     ///< gradient of g to x[next] (m); that to x[held] is its negative
  Eigen::Matrix3d curve;       ///< second derivative of g; positive semidefinite
  double per_square = 0;       ///< 1/m^4: the curvature's square over g
};

/// Second derivative of a half triple's energy by x[next] (N/m). Positive semidefinite for any law
/// that rises.
[[nodiscard]] Eigen::Matrix3d clamped_hessian(const Cloth& cloth, const ClampedPlace& place,
                                              const Field& x);

}  // namespace drape::simulate

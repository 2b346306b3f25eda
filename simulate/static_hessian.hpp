// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/cloth.hpp"
#include "simulate/static_factor.hpp"

namespace drape::sim {

/// Adds the second derivatives (N/m) of the cloth's energy, element by element. With `convex`
/// each element gives a positive semidefinite part only: springs without the softening of their
/// compression, cells without the change of direction of their shear.
void add_hessian(const Cloth& cloth, const Field& position, bool convex, GridMatrix& hessian);

}  // namespace drape::sim

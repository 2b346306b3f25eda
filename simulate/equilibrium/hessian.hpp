// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/cloth/cloth.hpp"
#include "simulate/sparse/factor.hpp"

namespace drape::simulate {

/// Strain of every spring, by direction (warp, weft) and first particle.
using SpringStrains = std::array<std::vector<double>, 2>;

/// Strains by the linear model at `from` after `displacement` (m; x, y, z of each
/// particle in turn): without the stretch that a straight displacement of a turning spring brings.
SpringStrains linear_strains(const Cloth& cloth, const Field& from,
                             const Eigen::VectorXd& displacement);

/// Adds the second derivatives (N/m) of the cloth's energy, element by element. With `convex`
/// each element gives a positive semidefinite part only: springs without the softening of their
/// compression, cells without the change of direction of their shear. With `strains`, springs pull
/// and stiffen as at these in place of their own (mixed form of Newton's method: Magisano,
/// Leonetti, Garcea 2017). The same bytes on any number of threads.
void add_hessian(const Cloth& cloth, const Field& position, bool convex, GridMatrix& hessian,
                 const SpringStrains* strains = nullptr, int threads = 1);

/// The part of internal friction (laws().friction); add_hessian() calls it.
void add_friction_hessian(const Cloth& cloth, const Field& position, bool convex,
                          GridMatrix& hessian);

}  // namespace drape::simulate

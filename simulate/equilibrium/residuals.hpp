// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>

namespace drape::simulate {

/// A linear system near a symmetric positive definite one that can be solved.
struct NearlySymmetric {
  std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& product)> multiply;
  std::function<void(Eigen::VectorXd& b)> solve;  ///< with the near matrix M, in place
};

struct ResidualsLeft {
  double energy = 0;  ///< r . M^-1 r of what is left
  int solves = 0;     ///< with M
};

/// Generalised minimal residuals (Saad and Schultz 1986): improves `answer` until the residual's
/// energy is below `enough`, or `most` directions were tried. Orthogonal and small are meant in the
/// energy of M, in which stiff and soft directions count alike; never worse than it came in.
ResidualsLeft minimise_residuals(const NearlySymmetric& system, const Eigen::VectorXd& right,
                                 Eigen::VectorXd& answer, double enough, int most);

}  // namespace drape::simulate

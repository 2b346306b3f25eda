// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// Scatter between views and the parameter covariance derived from it.
struct ViewScatter {
  /// Covariance of the cameras' free parameters and the bow; empty if they are inseparable. Widened
  /// by Student's t, so that +-1.96 standard deviations are a 95 % interval.
  Eigen::MatrixXd covariance;
  double inflation = 1;  ///< variance between views over that expected from the points' noise
  double shrinkage = 1;  ///< towards a common inflation of all parameters, 0 to 1
  double degrees_of_freedom = 0;  ///< for a stated variance
};

/// Cluster-robust covariance of a converged fit, with one cluster per placement of the target:
/// gradients of the views at the optimum, corrected for leverage (CR2: Bell and McCaffrey 2002), in
/// units of the covariance from the points' noise. With few views for many parameters it is shrunk
/// towards one common inflation (Ledoit and Wolf 2004). `least_inflation` is that of the residuals.
[[nodiscard]] ViewScatter scatter_of_views(const JointModel& model, const JointFit& fit,
                                           double least_inflation);

}  // namespace drape::calib

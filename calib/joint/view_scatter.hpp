// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// Scatter of the views themselves, and the parameters' covariance by it.
struct ViewScatter {
  /// Covariance of the cameras' moved parameters and the bow; empty when they cannot be separated.
  /// Widened by Student's t, so that +-1.96 standard deviations are a 95 % interval.
  Eigen::MatrixXd covariance;
  double inflation = 1;           ///< variance of the views over that of their points' noise
  double shrinkage = 1;           ///< towards one inflation for all parameters, 0 to 1
  double degrees_of_freedom = 0;  ///< behind a stated variance
};

/// Cluster-robust covariance of a converged fit, one cluster for each placement of the target: the
/// views' pulls at the optimum, freed from their own leverage (CR2: Bell and McCaffrey 2002), in
/// units of the covariance by the points' noise. What few views tell of many parameters is shrunk
/// to one common inflation (Ledoit and Wolf 2004). `least_inflation` is that of the residuals.
[[nodiscard]] ViewScatter scatter_of_views(const JointModel& model, const JointFit& fit,
                                           double least_inflation);

}  // namespace drape::calib

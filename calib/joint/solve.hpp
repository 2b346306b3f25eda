// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// What a joint fit may move, and how it ends.
struct JointFit {
  LensTerms lens = LensTerms::k1_k2_p1_p2;
  bool skew = false;
  bool bow = true;
  bool cameras = true;  ///< false: placements only, to test a calibration on poses it never saw
  int max_iterations = 100;
};

struct JointSolution {
  JointModel model;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0;  ///< weighted sum of squares at the end
};

/// Least squares over all cameras, unknown placements and the bow together (Levenberg-Marquardt,
/// the placements eliminated first), signed residuals weighted by the points' covariances.
[[nodiscard]] JointSolution solve_joint(JointModel start, const JointFit& fit);

/// Number of parameters that the fit moves.
[[nodiscard]] int free_parameters(const JointModel& model, const JointFit& fit);

/// Indices of a camera's parameters that the fit moves.
[[nodiscard]] std::vector<int> moved_camera_parameters(const JointFit& fit);

/// Information (inverse covariance) of all moved parameters: cameras, then the bow, then the
/// unknown placements, in the order of joint_model.hpp.
[[nodiscard]] Eigen::MatrixXd information_of(const JointModel& model, const JointFit& fit);

/// J'W d of a frame for each column of `disturbance_px` (2 rows a point): how strongly that
/// disturbance of the frame's pixels pulls at the parameters of information_of().
[[nodiscard]] Eigen::MatrixXd pull_of(const JointModel& model, const JointFit& fit,
                                      const JointFrame& frame,
                                      const Eigen::MatrixXd& disturbance_px);

/// Information that one more view of the target would add to cameras and bow, its own placement
/// eliminated. `frames` are the new view's.
[[nodiscard]] Eigen::MatrixXd information_of_view(const JointModel& model, const JointFit& fit,
                                                  const Placement& placement,
                                                  const std::vector<JointFrame>& frames);

/// Inverse of a symmetric positive matrix of mixed units; empty when it is numerically singular.
[[nodiscard]] Eigen::MatrixXd inverse_of_information(const Eigen::MatrixXd& information);

}  // namespace drape::calib

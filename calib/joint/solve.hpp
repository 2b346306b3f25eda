// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// Parameters that a joint fit may move, and its limit of iterations.
struct JointFit {
  LensTerms lens = LensTerms::k1_k2_p1_p2;
  bool skew = false;
  bool bow = true;
  bool lens_known = false;  ///< the cameras' lenses stay as they are
  bool cameras = true;      ///< false: placements only, to test a calibration on poses it never saw
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
/// `near`: the start is a solution of nearly the same problem, so that full Gauss-Newton steps are
/// tried from the first on.
[[nodiscard]] JointSolution solve_joint(JointModel start, const JointFit& fit, bool near = false);

/// Number of parameters that the fit moves.
[[nodiscard]] int free_parameters(const JointModel& model, const JointFit& fit);

/// Indices of a camera's parameters that the fit moves.
[[nodiscard]] std::vector<int> moved_camera_parameters(const JointFit& fit);

/// Information (inverse covariance) of all moved parameters: cameras, then the bow, then the
/// unknown placements, in the order of joint_model.hpp.
[[nodiscard]] Eigen::MatrixXd information_of(const JointModel& model, const JointFit& fit);

/// Image minus measured place of a frame's points (px, two rows a point), 0 where one does not
/// project.
[[nodiscard]] Eigen::VectorXd residuals_px(const JointModel& model, const JointFrame& frame);

/// Information of one placement of the target on cameras and bow, its own pose eliminated.
struct ViewInformation {
  std::size_t placement = 0;
  Eigen::MatrixXd information;  ///< inverse covariance, from the points' covariances
  Eigen::VectorXd score;        ///< pull of the residuals, J'Wr; their sum is zero at the optimum
  Eigen::MatrixXd with_world;   ///< the information where this placement alone holds the world
};

/// Parameters that the fit does not have: derivative of a frame (px, two rows a point) by each.
struct MoreColumns {
  Eigen::Index count = 0;
  std::function<Eigen::MatrixXd(const JointFrame&)> of = {};
};

/// By placement that is seen; the parameters of `more` stand last, after the bow.
[[nodiscard]] std::vector<ViewInformation> information_by_view(const JointModel& model,
                                                               const JointFit& fit,
                                                               const MoreColumns& more = {});

}  // namespace drape::calib

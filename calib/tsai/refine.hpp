// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/camera_model.hpp"

namespace drape::calib {

/// Sets of free parameters of a refinement.
enum class TsaiFree {
  focal_depth_kappa,  ///< f, Tz, kappa1: the nonlinear part of stage 2
  all_but_scale_x,    ///< stage 3 with s_x fixed
  all,                ///< stage 3 with s_x free
};

struct Refinement {
  Camera camera;
  bool converged = false;
  int iterations = 0;
  double chi2 = 0;  ///< weighted sum of squares at the end
};

/// Least squares of the signed distorted residuals in x and y, weighted by the points' covariances
/// (Levenberg-Marquardt). The camera must have a Tsai lens.
[[nodiscard]] Refinement refine_tsai(const Camera& start, const std::vector<Correspondence>& points,
                                     TsaiFree free, int max_iterations);

/// Covariance of all parameters, in the order and units of parameter_names(), from the marks'
/// covariances; rows and columns of fixed parameters are zero. Empty if singular.
[[nodiscard]] Eigen::MatrixXd tsai_covariance(const Camera& camera,
                                              const std::vector<Correspondence>& points,
                                              TsaiFree free);

/// Number of free parameters.
[[nodiscard]] int free_parameters(TsaiFree free);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/joint/solve.hpp"
#include "core/calibration.hpp"

namespace drape::calib {

struct JointCovariance {
  std::vector<std::string> names;  ///< "cam0/fx_px" ..., by parameter_names()
  Eigen::MatrixXd cameras;         ///< in file units; empty when singular
  Eigen::Vector2d bow_sd_mm = Eigen::Vector2d::Zero();
};

/// Covariance of all cameras' parameters, placements and bow taken out, times `variance_factor`,
/// from information_of() and, unless it is empty, common_error_pull(). Parameters that the fit
/// keeps have zero rows and columns.
[[nodiscard]] JointCovariance joint_covariance(const JointModel& model, const JointFit& fit,
                                               const Eigen::MatrixXd& information,
                                               const Eigen::MatrixXd& common,
                                               double variance_factor);

/// Adds what an uncertain print scale (1) does: all translations grow together. `covariance` is of
/// the cameras' parameters in file units.
void add_scale_uncertainty(Eigen::MatrixXd& covariance, const JointModel& model,
                           double scale_uncertainty);

/// Covariance (mm^2) of the camera centre in the world, from the camera's own covariance.
[[nodiscard]] Eigen::Matrix3d centre_covariance_mm2(const CalibratedCamera& camera);

}  // namespace drape::calib

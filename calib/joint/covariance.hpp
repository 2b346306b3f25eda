// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/joint/solve.hpp"
#include "core/calibration.hpp"
#include "core/rig.hpp"

namespace drape::calib {

struct JointCovariance {
  std::vector<std::string> names;  ///< "cam0/fx_px" ..., as in parameter_names()
  Eigen::MatrixXd cameras;         ///< in file units; empty if singular
  Eigen::MatrixXd target;          ///< part due to the board parameters that the fit moves
  /// Standard deviations of the board's parameters; 0 for those that the fit keeps fixed.
  Eigen::Matrix<double, board_parameters, 1> board_sd =
      Eigen::Matrix<double, board_parameters, 1>::Zero();
};

/// Covariance of all cameras' parameters in file units, from that of the free camera and board
/// parameters (`parameters`). Fixed parameters have zero rows and columns; empty if the input is.
[[nodiscard]] JointCovariance joint_covariance(const JointModel& model, const JointFit& fit,
                                               const Eigen::MatrixXd& parameters);

/// Camera parameters of `a` minus those of `b` in file units; rotations as difference of rotation
/// vectors.
[[nodiscard]] Eigen::VectorXd file_difference(const JointModel& a, const JointModel& b);

/// Adds the effect of an uncertain print scale (1), which scales all translations together.
/// `covariance` is that of the cameras' parameters in file units.
void add_scale_uncertainty(Eigen::MatrixXd& covariance, const JointModel& model,
                           double scale_uncertainty);

/// Copies lenses from a calibration to the model's cameras, by name. Throws Error(bad_input) naming
/// a camera that is missing, has another image size or a Tsai lens.
void use_lenses(JointModel& model, const Calibration& known);

/// Adds the effect of uncertain known lenses: their own covariance, and that of the poses that
/// depend on them. `covariance` is that of the cameras' parameters in file units.
void add_known_lenses(Eigen::MatrixXd& covariance, const JointModel& model, JointFit fit,
                      const Calibration& known);

/// Converts the board of a fit with free points to a plate for other calibrations: positions,
/// covariance of their common errors (`print`), and remaining error of each; `inflation` is the
/// variance over that of the points' noise. nullopt if the parameters are inseparable.
[[nodiscard]] std::optional<MeasuredPlate> measured_plate(
    const JointModel& model, const JointFit& fit, double inflation,
    Eigen::Matrix<double, board_parameters, 1>& print);

/// Covariance (mm^2) of the camera centre in the world, from the camera's own covariance.
[[nodiscard]] Eigen::Matrix3d centre_covariance_mm2(const CalibratedCamera& camera);

}  // namespace drape::calib

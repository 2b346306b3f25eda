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
  std::vector<std::string> names;  ///< "cam0/fx_px" ..., by parameter_names()
  Eigen::MatrixXd cameras;         ///< in file units; empty when singular
  /// Standard deviations of the board's parameters; 0 where the fit keeps one.
  Eigen::Matrix<double, board_parameters, 1> board_sd =
      Eigen::Matrix<double, board_parameters, 1>::Zero();
};

/// Covariance of all cameras' parameters in file units from that of the cameras' moved parameters
/// and the board (`parameters`). What the fit keeps has zero rows and columns; empty from empty.
[[nodiscard]] JointCovariance joint_covariance(const JointModel& model, const JointFit& fit,
                                               const Eigen::MatrixXd& parameters);

/// Cameras' parameters of `a` minus those of `b` in file units; a turn is that of a rotation
/// vector.
[[nodiscard]] Eigen::VectorXd file_difference(const JointModel& a, const JointModel& b);

/// Adds what an uncertain print scale (1) does: all translations grow together. `covariance` is of
/// the cameras' parameters in file units.
void add_scale_uncertainty(Eigen::MatrixXd& covariance, const JointModel& model,
                           double scale_uncertainty);

/// Gives the model's cameras the lenses of a calibration, by name. Throws Error(bad_input) naming
/// the camera when it is missing, has another image size or Tsai's lens.
void use_lenses(JointModel& model, const Calibration& known);

/// Adds what uncertain known lenses leave open: the lenses' own covariance, and the poses that
/// follow a lens. `covariance` is of the cameras' parameters in file units.
void add_known_lenses(Eigen::MatrixXd& covariance, const JointModel& model, JointFit fit,
                      const Calibration& known);

/// The board of a fit with free points as a plate for other calibrations: places, the covariance of
/// what they share (`print`), and what is left of each; `inflation`: variance over that of the
/// points' noise. Nothing where the parameters cannot be separated.
[[nodiscard]] std::optional<MeasuredPlate> measured_plate(
    const JointModel& model, const JointFit& fit, double inflation,
    Eigen::Matrix<double, board_parameters, 1>& print);

/// Covariance (mm^2) of the camera centre in the world, from the camera's own covariance.
[[nodiscard]] Eigen::Matrix3d centre_covariance_mm2(const CalibratedCamera& camera);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"
#include "core/calibration.hpp"
#include "core/geometry/next_pose.hpp"
#include "core/rig.hpp"

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

struct JointCovariance {
  std::vector<std::string> names;  ///< "cam0/fx_px" ..., as in parameter_names()
  Eigen::MatrixXd cameras;         ///< in file units; empty if singular
  Eigen::MatrixXd target;          ///< part due to the board parameters that the fit estimates
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

/// Region in which cloth may hang: above the target, up to its highest stage.
[[nodiscard]] WorldBox drape_volume(const JointModel& model);

/// Standard deviation (px, one coordinate) of a world point's image due to the calibration alone;
/// nullopt if the point does not project or the camera has no covariance.
[[nodiscard]] std::optional<double> projected_sd_px(const CalibratedCamera& camera,
                                                    const Eigen::Vector3d& point_in_world);

/// Root mean square over a grid of the standard deviation (mm, all three axes together).
[[nodiscard]] std::optional<double> volume_sd_mm(const Calibration& calibration,
                                                 const std::vector<Eigen::Vector3d>& points);

/// Drift of a camera between two calibrations, evaluated in the volume of the cloth.
struct CameraDrift {
  std::string camera;
  double moved_px = 0;     ///< RMS distance between the old and new image of a world point
  double expected_px = 0;  ///< RMS expected from the two stated covariances
  double p = 1;            ///< probability of such a drift by chance
  [[nodiscard]] bool drifted() const { return p < 1e-3; }
};

struct Drift {
  std::vector<CameraDrift> cameras;     ///< cameras in both calibrations, by name
  double moved_mm = 0;                  ///< RMS displacement of a point measured by all cameras
  double expected_mm = 0;               ///< expected from the two covariances
  std::vector<std::string> not_in_old;  ///< names of new cameras
};

/// Compares two calibrations at `points` (metres, in the world of `now`). Aligns the worlds first,
/// since each depends on its own placement of the target; the remainder is relative motion of
/// lenses and cameras. Throws Error(bad_input) if they have no common camera.
[[nodiscard]] Drift drift_between(const Calibration& old, const Calibration& now,
                                  const std::vector<Eigen::Vector3d>& points);

}  // namespace drape::calib

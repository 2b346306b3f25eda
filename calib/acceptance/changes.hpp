// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/acceptance/acceptance.hpp"
#include "calib/acceptance/positions.hpp"

namespace drape::calib {

/// Changes since the calibration, estimated from all positions together.
struct Changes {
  /// Growth of the plate, its bow, motion of each camera: each as if it were the only change.
  std::vector<AcceptanceFigure> figures;
  std::string cause;  ///< the change beyond its limit that explains most; empty if there is none
  double noise_variance = 1;  ///< variance of the detections over the stated one, at least 1
};

/// Standard uncertainties of the plate.
struct PlateUncertainty {
  double scale = 0;                                  ///< relative uncertainty of its size (1)
  Eigen::Vector2d bow_mm = Eigen::Vector2d::Zero();  ///< stated bow along x and y
  [[nodiscard]] bool has_bow() const { return bow_mm.maxCoeff() > 0; }
};

/// Generalised least squares of every point of every position against the calibrated cameras: each
/// position has its own pose, the calibration errs by its covariance (`root` root'), the points by
/// theirs, enlarged if the positions scatter more. `false_no_go` is the probability for one figure.
[[nodiscard]] Changes changes_since(const Detections& detections, const Calibration& calibration,
                                    const Plate& plate, const std::vector<Position>& positions,
                                    const Eigen::MatrixXd& root,
                                    const PlateUncertainty& plate_uncertainty, double false_no_go);

}  // namespace drape::calib

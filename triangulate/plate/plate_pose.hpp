// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/pose.hpp"
#include "triangulate/lattice_views.hpp"

namespace drape::triangulate {

/// Pose of a plate of dots with tags. Its frame is that of a calibration target: origin at the
/// centre of the dots, x along the columns, y along the rows, z out of the printed face.
struct PlatePose {
  WorldFromObject world_from_plate;
  /// Covariance of the origin (m) and of a small rotation about the world's axes (rad), from the
  /// dots' noise, scaled to the residuals, and from the cameras' covariance.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int dots = 0;
  int views = 0;            ///< number of dot views over all cameras
  double rms_px = 0;        ///< root mean square of the residuals
  double chi2_per_dof = 0;  ///< relative to the dots' covariance; should be about 1
};

/// Rigid pose that fits all dots of a set: Gauss-Newton on pixels over all cameras, with each dot
/// as the centroid of its image. The cameras' covariance, including their correlation, is
/// propagated. Throws Error(bad_input) if the set does not exist, the detections are not of a
/// target, fewer than four dots are seen by two cameras, or the fit does not converge.
[[nodiscard]] PlatePose plate_pose(const Detections& detections, const Calibration& calibration,
                                   const std::string& set, double floor_px);

/// Same, from existing views; `marks` outside the lattice are ignored.
[[nodiscard]] PlatePose plate_pose(const std::vector<MarkViews>& marks, const MarkLattice& lattice);

}  // namespace drape::triangulate

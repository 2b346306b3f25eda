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

/// Pose of a plate of dots with tags. Its frame is that of a calibration target: origin in the
/// middle of the dots, x along the columns, y along the rows, z out of the printed face.
struct PlatePose {
  WorldFromObject world_from_plate;
  /// Covariance of the origin (m) and of a small turn about the world's axes (rad), from the dots'
  /// noise, in the size that the residuals show, and the cameras' covariance together.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  int dots = 0;
  int views = 0;            ///< views of dots, over all cameras
  double rms_px = 0;        ///< root mean square of the residuals
  double chi2_per_dof = 0;  ///< against the dots' covariance; about 1 is right
};

/// The rigid pose that all dots of a set agree on: Gauss-Newton on pixels over all cameras, each
/// dot as the centroid of its image. The cameras' covariance is taken through the solution with
/// what cameras have in common. Throws Error(bad_input) when the set is not there, the detections
/// are not of a target, fewer than four dots are seen by two cameras, or the fit does not converge.
[[nodiscard]] PlatePose plate_pose(const Detections& detections, const Calibration& calibration,
                                   const std::string& set, double floor_px);

/// The same from views that are there already; `marks` beyond the lattice are ignored.
[[nodiscard]] PlatePose plate_pose(const std::vector<MarkViews>& marks, const MarkLattice& lattice);

}  // namespace drape::triangulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/camera_model.hpp"

namespace drape::calib {

/// Fixed inputs of Tsai's stage 1: sensor pitch (m) and image centre (px).
struct TsaiSensor {
  double pixel_pitch_x_m = 0, pixel_pitch_y_m = 0;
  double cx_px = 0, cy_px = 0;
};

/// Result of the radial alignment constraint: all parameters except f, Tz and kappa1.
struct RadialAlignment {
  Eigen::Matrix3d rotation;  ///< camera from world
  double tx_m = 0, ty_m = 0;
  double scale_x = 1;
  bool origin_shifted = false;  ///< solved with a shifted origin because Ty was near 0
};

/// Stage 1 for points at several heights: 7 unknowns, at least 7 points (Tsai 1987, section IV).
/// nullopt if the points do not determine them.
[[nodiscard]] std::optional<RadialAlignment> align_non_coplanar(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor);

/// Stage 1 for points of the plane z = 0: 5 unknowns, at least 5 points, s_x stays 1 (Tsai 1987,
/// section III). nullopt if the points do not determine them.
[[nodiscard]] std::optional<RadialAlignment> align_coplanar(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor);

/// Linear part of stage 2: f and Tz with kappa1 = 0, from the image y (Tsai 1987, eq. 15).
struct FocalAndDepth {
  double focal_m = 0;  ///< negative if the points are mirrored (left-handed)
  double tz_m = 0;
};
[[nodiscard]] std::optional<FocalAndDepth> solve_focal_and_depth(
    const std::vector<Correspondence>& points, const TsaiSensor& sensor,
    const RadialAlignment& alignment);

/// The same alignment with the other sign of x and y in the third row: a single plane determines
/// the rotation only up to this reflection, which the sign of the focal length resolves.
[[nodiscard]] RadialAlignment mirrored(const RadialAlignment& alignment);

/// Camera with kappa1 = 0 from stage 1 and the linear part of stage 2.
[[nodiscard]] Camera start_camera(const TsaiSensor& sensor, const RadialAlignment& alignment,
                                  const FocalAndDepth& depth);

}  // namespace drape::calib

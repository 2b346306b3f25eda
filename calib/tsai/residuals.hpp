// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/calibration.hpp"

namespace drape::calib {

/// Distances of the points from their images (px, distorted) and of the target points from the
/// back-projected rays (mm). Points that do not project are left out of `points`.
[[nodiscard]] CalibrationResiduals residuals_of(const Camera& camera,
                                                const std::vector<Correspondence>& points);

/// Point distance in the distorted image (px); infinite when the point does not project.
[[nodiscard]] double distance_px(const Camera& camera, const Correspondence& point);

/// Weng's normalised calibration error: mean ratio of the miss of the ray at the point's depth to
/// what rounding to whole pixels would cause (Weng, Cohen, Herniou 1992).
[[nodiscard]] double normalised_error(const Camera& camera,
                                      const std::vector<Correspondence>& points);

/// Mean and largest of one error measure.
struct ErrorMeasure {
  double mean = 0, max = 0;
};

/// The four classical measures of a calibration (Tsai 1987; Weng, Cohen, Herniou 1992): distances
/// in the distorted image, in the image freed from distortion, of the target point from its ray
/// (mm), and Weng's ratio (1: as good as a pixel's own rounding). Points that do not project or
/// have no ray are left out.
struct ClassicalErrors {
  ErrorMeasure distorted_px, undistorted_px, object_mm;
  double normalised = 0;
};
[[nodiscard]] ClassicalErrors classical_errors(const Camera& camera,
                                               const std::vector<Correspondence>& points);

/// Rectangle (u_min, v_min, u_max, v_max) that the points cover, px.
[[nodiscard]] Eigen::Vector4d covered_region_px(const std::vector<Correspondence>& points);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "calib/tsai/correspondence.hpp"
#include "core/calibration.hpp"

namespace drape::calib {

/// Negligible error at the target: of a point, of a z stage (at the edge of the highest one), or of
/// a camera that moved; also the accuracy required of camera positions.
inline constexpr double harmless_m = 0.03e-3;

/// Distances of image points from projections (px, distorted) and of target points from
/// back-projected rays (mm). Points that do not project are left out of `points`.
[[nodiscard]] CalibrationResiduals residuals_of(const Camera& camera,
                                                const std::vector<Correspondence>& points);

/// Distance in the distorted image (px); infinite if the point does not project.
[[nodiscard]] double distance_px(const Camera& camera, const Correspondence& point);

/// Distance of the world point from the ray through its pixel, metres; nullopt if no ray has it.
[[nodiscard]] std::optional<double> miss_m(const Camera& camera, const Correspondence& point);

/// Weng's normalised calibration error: mean ratio of the ray's distance from the point, at the
/// point's depth, to that caused by rounding to whole pixels (Weng, Cohen, Herniou 1992).
[[nodiscard]] double normalised_error(const Camera& camera,
                                      const std::vector<Correspondence>& points);

/// Mean and maximum of one error measure.
struct ErrorMeasure {
  double mean = 0, max = 0;
};

/// The four classical measures of calibration error (Tsai 1987; Weng, Cohen, Herniou 1992):
/// distance in the distorted image, in the undistorted image, of the target point from its ray
/// (mm), and Weng's ratio (1 corresponds to rounding to pixels). Points that do not project or have
/// no ray are left out.
struct ClassicalErrors {
  ErrorMeasure distorted_px, undistorted_px, object_mm;
  double normalised = 0;
};
[[nodiscard]] ClassicalErrors classical_errors(const Camera& camera,
                                               const std::vector<Correspondence>& points);

/// Rectangle (u_min, v_min, u_max, v_max) covered by the points, px.
[[nodiscard]] Eigen::Vector4d covered_region_px(const std::vector<Correspondence>& points);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/camera_model.hpp"
#include "core/rig.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {

struct PredictOptions {
  double height_m = 0.1;         ///< height of the drape volume above the world's origin
  double floor_px = 0.02;        ///< additional error of a centre, as in drape triangulate
  double most_facing_deg = 60;   ///< a dot seen at a larger angle does not count as seen
  double asked_sigma_m = 5e-5;   ///< in space, root of the sum of the three variances
  double asked_fraction = 0.95;  ///< fraction of the marks that must achieve it
  RenderOptions render;          ///< brightness, blur and noise of the pictures
};
/// Describes the options without those of `render`.
void fields(Fields& f, PredictOptions& options);

/// Prediction for marks of one slope over the volume.
struct PredictedSlope {
  double slope_deg = 0;
  int marks = 0;
  int seen_by_two = 0;             ///< marks seen by at least two cameras
  double median_m = 0, p95_m = 0;  ///< standard deviation in space of these marks
  double median_height_m = 0;      ///< the same for their height only
  double median_px = 0;  ///< median standard deviation of a centre in a picture, without the floor
};

struct Prediction {
  std::vector<PredictedSlope> slopes;  ///< slopes of 0, 30, 45, 60 degrees in eight directions
  double reached_fraction =
      0;  ///< fraction of the marks seen by two cameras that meet the required accuracy
  double seen_fraction = 0;  ///< fraction of all marks seen by at least two cameras
  bool go = false;           ///< both fractions are sufficient for slopes up to 45 degrees
};

/// Smallest covariance (px^2) of any unbiased estimate of a dot's centre: Cramer-Rao bound for an
/// edge of contrast C with blur s and white noise, integrated along the elliptical outline of the
/// dot, with known brightness and shape.
[[nodiscard]] std::optional<Eigen::Matrix2d> centre_bound_px2(const Camera& camera,
                                                              const Eigen::Vector3d& in_world,
                                                              const Eigen::Vector3d& normal,
                                                              double radius_m,
                                                              const RenderOptions& render);

/// Accuracy that these cameras can achieve over the volume in which the print is draped, from the
/// noise of the marks alone, without errors of the calibration and of dots on curved cloth.
[[nodiscard]] Prediction predict(const std::vector<Camera>& cameras, const Print& print,
                                 const PredictOptions& options);

}  // namespace drape::synth

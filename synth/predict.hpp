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
  double floor_px = 0.02;        ///< error of a centre beyond its noise, as in drape triangulate
  double most_facing_deg = 60;   ///< a dot seen more askew is not counted as seen
  double asked_sigma_m = 5e-5;   ///< in space, root sum of the three variances
  double asked_fraction = 0.95;  ///< fraction of the marks that must reach it
  RenderOptions render;          ///< light, blur and noise of the pictures
};
/// Without those of `render`.
void fields(Fields& f, PredictOptions& options);

/// Marks of one slope over the volume.
struct PredictedSlope {
  double slope_deg = 0;
  int marks = 0;
  int seen_by_two = 0;             ///< cameras or more
  double median_m = 0, p95_m = 0;  ///< standard deviation in space of those
  double median_height_m = 0;      ///< and of their height alone
  double median_px = 0;            ///< median of a centre in a picture, without the floor
};

struct Prediction {
  std::vector<PredictedSlope> slopes;  ///< 0, 30, 45, 60 degrees, turned to eight sides
  double reached_fraction =
      0;                     ///< part of the marks that two cameras see within the asked accuracy
  double seen_fraction = 0;  ///< part of all marks that two cameras or more see
  bool go = false;           ///< both fractions reach what was asked for slopes up to 45 degrees
};

/// Smallest covariance (px^2) that any unbiased estimate of a dot's centre can have: Cramer-Rao
/// bound of an edge of contrast C under a blur s and white noise, integrated around the ellipse
/// that the dot's outline makes, light and shape taken as known.
[[nodiscard]] std::optional<Eigen::Matrix2d> centre_bound_px2(const Camera& camera,
                                                              const Eigen::Vector3d& in_world,
                                                              const Eigen::Vector3d& normal,
                                                              double radius_m,
                                                              const RenderOptions& render);

/// Accuracy that these cameras can give over the volume in which the print is draped: the noise of
/// the marks alone, without that of the calibration and of bent dots.
[[nodiscard]] Prediction predict(const std::vector<Camera>& cameras, const Print& print,
                                 const PredictOptions& options);

}  // namespace drape::synth

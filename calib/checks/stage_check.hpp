// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"
#include "calib/tsai/correspondence.hpp"
#include "calib/tsai/refine.hpp"

namespace drape::calib {

/// Actual motion of the target on its z stage, estimated from the views.
struct StageCheck {
  double stroke_mm = 0;  ///< travel from lowest to highest stage
  Eigen::Vector2d tilt_deg,
      tilt_sd_deg;            ///< tilt of the axis from the plate's normal, towards x and y
  double stroke_percent = 0;  ///< deviation of the travel from rig.toml; NaN if far off
  double stroke_sd_percent = 0;
  Eigen::Vector3d turn_deg, turn_sd_deg;  ///< rotation of the plate about x, y, z over the travel
  /// Why the target's pitch and the stage's heights cannot both be right; empty if consistent.
  std::string contradiction;
  std::vector<std::string> findings;  ///< implausibly large motions, with the remedy

  /// True for errors beyond any stage's: rig.toml or the target's file uses another unit.
  [[nodiscard]] bool other_unit() const { return std::abs(stroke_percent) > 50; }
};

/// Fits all views again with every stage but the first as a free pose and compares the resulting
/// positions with rig.toml. `model` holds all points, outliers included. nullopt if there are fewer
/// than two stages or the views alone cannot locate them.
[[nodiscard]] std::optional<StageCheck> check_stages(JointModel model, const JointFit& fit,
                                                     const JointCleaning& cleaning);

/// For one camera of Tsai's method, which needs the stages: first-order estimate from its residuals
/// (a score test). `chi2` belongs to the fit to `points`, whose heights are those of rig.toml times
/// `heights_times`.
[[nodiscard]] std::optional<StageCheck> check_stages(const Camera& camera,
                                                     const std::vector<Correspondence>& points,
                                                     TsaiFree free, double chi2,
                                                     double heights_times = 1);

/// Same, if the travel is so far off that the first order fails: scales the heights and fits the
/// camera again until no deviation is left. States no factor if that fails.
[[nodiscard]] std::optional<StageCheck> check_stages_far_off(
    const Camera& camera, const std::vector<Correspondence>& points, TsaiFree free, double chi2,
    int max_iterations);

/// Summary in one line.
[[nodiscard]] std::string text_of(const StageCheck& check);

}  // namespace drape::calib

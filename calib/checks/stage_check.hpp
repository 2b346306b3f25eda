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

/// Real motion of the target on its z stage, as far as the views tell.
struct StageCheck {
  double stroke_mm = 0;  ///< highest minus lowest stage
  Eigen::Vector2d tilt_deg,
      tilt_sd_deg;            ///< tilt of the axis off the plate's normal, towards x and y
  double stroke_percent = 0;  ///< travel minus what rig.toml says; NaN: far off
  double stroke_sd_percent = 0;
  Eigen::Vector3d turn_deg, turn_sd_deg;  ///< turn of the plate about x, y, z over the whole stroke
  /// Why the target's pitch and the stage's strokes cannot both be right; empty: they may be.
  std::string contradiction;
  std::vector<std::string> findings;  ///< motions too large to be believed, with the remedy

  /// Heights that no stage is wrong by: rig.toml or the target's file has another unit.
  [[nodiscard]] bool other_unit() const { return std::abs(stroke_percent) > 50; }
};

/// Fits all views again with every stage but the first as a free pose, and compares where they come
/// to lie with where rig.toml says. `model` holds all points, outliers included. Nothing when there
/// are no two stages, or when the views alone cannot place them.
[[nodiscard]] std::optional<StageCheck> check_stages(JointModel model, const JointFit& fit,
                                                     const JointCleaning& cleaning);

/// For one camera of Tsai's method, which cannot do without the stages: what its residuals say, to
/// first order (a score test). `chi2` is that of the fit to `points`, whose heights are rig.toml's
/// times `heights_times`.
[[nodiscard]] std::optional<StageCheck> check_stages(const Camera& camera,
                                                     const std::vector<Correspondence>& points,
                                                     TsaiFree free, double chi2,
                                                     double heights_times = 1);

/// The same where the stroke is so far off that the first order misleads: heights are multiplied
/// and the camera fitted again until no stroke is left over. Says no factor where that fails.
[[nodiscard]] std::optional<StageCheck> check_stages_far_off(
    const Camera& camera, const std::vector<Correspondence>& points, TsaiFree free, double chi2,
    int max_iterations);

/// One line for people.
[[nodiscard]] std::string text_of(const StageCheck& check);

}  // namespace drape::calib

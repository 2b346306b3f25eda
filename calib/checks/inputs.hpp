// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/joint/fit.hpp"
#include "calib/tsai/tsai.hpp"
#include "core/detections.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Throws Error(bad_input) if a length measured on the target contradicts its pitch by more
/// than three standard uncertainties, including the `tolerance` (1) of the print: every
/// measured length would have the same relative error. The message names the consistent
/// pitch.
void check_known_lengths(const Target& target, double tolerance);

/// Relative standard uncertainty of the print's scale; 0 if no length was measured.
[[nodiscard]] double scale_uncertainty(const Target& target);

/// Sentence about the scale of the print.
[[nodiscard]] std::string print_scale_line(const Target& target);

/// A selection of sets in a detections file.
struct PictureSource {
  const Detections& detections;
  std::string file;               ///< for messages; can be empty
  std::vector<std::string> sets;  ///< cameras to consider; empty for all
};

/// Throws Error(bad_input) naming both frames if the same picture occurs twice, in two sets or for
/// two cameras: it carries the information of one view only.
void refuse_pictures_twice(const PictureSource& source);

/// Same, also if a picture of `tested` was used for calibration and so is no independent test.
void refuse_pictures_of(const PictureSource& calibrated, const PictureSource& tested);

/// Throws Error(bad_input) if rig.toml names a set of the target twice: its views would count
/// twice.
void refuse_sets_twice(const Rig& rig);

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

  /// True for errors too large for any stage: rig.toml or the target's file uses another unit.
  [[nodiscard]] bool other_unit() const { return std::abs(stroke_percent) > 50; }
};

/// Fits all views again with every stage but the first as a free pose and compares the resulting
/// positions with rig.toml. `model` holds all points, including outliers. nullopt if there are
/// fewer than two stages or the views alone cannot locate them.
[[nodiscard]] std::optional<StageCheck> check_stages(JointModel model, const JointFit& fit,
                                                     const JointCleaning& cleaning);

/// Estimates the same for one camera of Tsai's method, which needs the stages, to first order from
/// its residuals (score test). `chi2` belongs to the fit to `points`, whose heights are those of
/// rig.toml times `heights_times`.
[[nodiscard]] std::optional<StageCheck> check_stages(const Camera& camera,
                                                     const std::vector<Correspondence>& points,
                                                     TsaiFree free, double chi2,
                                                     double heights_times = 1);

/// Same, for a travel too far off for the first order: scales the heights and fits the camera again
/// until no deviation is left. Omits the factor if that fails.
[[nodiscard]] std::optional<StageCheck> check_stages_far_off(
    const Camera& camera, const std::vector<Correspondence>& points, TsaiFree free, double chi2,
    int max_iterations);

/// Summary in one line.
[[nodiscard]] std::string text_of(const StageCheck& check);

}  // namespace drape::calib

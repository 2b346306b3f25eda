// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/solve.hpp"
#include "calib/tsai/residuals.hpp"

namespace drape::calib {

/// Limits for cleaning the measured points during the fit.
struct JointCleaning {
  double dot_diameter_m = 0;  ///< 0 for corners, which have no eccentricity
  double robust_sigmas = 3;   ///< above this a point's weight falls as 1/distance (Huber 1964)
  double outlier_sigmas = 6;  ///< above this it is rejected by name, unless the error is negligible
};

/// Repeats fit, prediction of each dot's eccentricity and of each point's robust weight until they
/// converge. Distances are in units of the points' standard deviations, whose scale is estimated
/// from the median.
[[nodiscard]] JointSolution fit_joint(const JointModel& start, const JointFit& fit,
                                      const JointCleaning& cleaning);

/// Indices of the frames in which most points are too far off to be noise.
[[nodiscard]] std::vector<std::size_t> frames_off(const JointModel& model,
                                                  const JointCleaning& cleaning);

/// Number of points that are off by more than the limit at the target.
[[nodiscard]] std::size_t points_farther(const JointModel& model, double limit_m);

/// Removes points too far off to be noise; describes each by set, camera and index.
[[nodiscard]] std::vector<std::string> reject_outliers(JointModel& model,
                                                       const JointCleaning& cleaning);

/// Error of a lens and a board on held-out views, with the placement of each view
/// fitted.
struct HeldOut {
  LensTerms lens = LensTerms::k1;
  BoardKind board = BoardKind::bow;
  double rms_px = 0;     ///< RMS point distance
  double object_mm = 0;  ///< same, at the point's distance from the camera
  int points = 0;
  struct View {
    double squares_px2 = 0;
    int points = 0;
  };
  std::vector<View> views;  ///< by placement, in an order independent of names and numbering
};

/// Sets parameters to 0 that the fit's lens and board do not have.
void clear_unused(JointModel& model, const JointFit& fit);

/// Leaves out one of `groups` groups of placements at a time; one placement always stays and
/// defines the world, chosen independently of the views' order.
[[nodiscard]] HeldOut held_out_error(const JointModel& solved, JointFit fit, int groups);

/// Index of the smallest lens (board) whose held-out error no larger one reduces by more than the
/// standard error of the difference (Breiman et al. 1984; bootstrap over placements, fixed seed). A
/// real term is included however small it is against the noise of one point, since its bias is
/// common to thousands of points.
[[nodiscard]] std::size_t choose(const std::vector<HeldOut>& table);

/// Probability that each lens (board) has the least held-out error if placements are resampled from
/// the given ones; in the order of `table`, sum 1. It differs from how often choose() selects it:
/// intervals based on that have lower coverage on real boards (half_split_test).
[[nodiscard]] std::vector<double> probabilities(const std::vector<HeldOut>& table);

/// Distance (px) of a point from its image; infinite if it does not project.
[[nodiscard]] double distance_px(const JointModel& model, const JointFrame& frame,
                                 const TargetPoint& point);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// An error at the target that does no harm: of a z stage at the edge of the highest one, of a
/// point, of a camera that moved. What the cameras' own places are to be known to.
inline constexpr double harmless_m = 0.03e-3;

/// Limits by which measured points are cleaned while they are fitted.
struct JointCleaning {
  double dot_diameter_m = 0;  ///< 0: corners, which have no eccentricity
  double robust_sigmas = 3;   ///< beyond, a point's weight falls as 1/distance (Huber 1964)
  double outlier_sigmas = 6;  ///< beyond, it is rejected by name; not for a harmless error
};

/// Fits, predicts each disc's eccentricity and each point's robust weight from the result, and fits
/// again until neither changes. Distances are in units of the points' standard deviations, their
/// scale is learned from the median.
[[nodiscard]] JointSolution fit_joint(const JointModel& start, const JointFit& fit,
                                      const JointCleaning& cleaning);

/// Indices of the frames most of whose points are too far off to be noise.
[[nodiscard]] std::vector<std::size_t> frames_off(const JointModel& model,
                                                  const JointCleaning& cleaning);

/// Number of points farther off than that at the target.
[[nodiscard]] std::size_t points_farther(const JointModel& model, double limit_m);

/// Takes out the points too far off to be noise; says each by set, camera and index.
[[nodiscard]] std::vector<std::string> reject_outliers(JointModel& model,
                                                       const JointCleaning& cleaning);

/// Error of a lens and a board on views that the calibration never saw, each view's placement
/// fitted to it.
struct HeldOut {
  LensTerms lens = LensTerms::k1;
  BoardKind board = BoardKind::bow;
  double rms_px = 0;     ///< point distance
  double object_mm = 0;  ///< the same at the point's distance from the camera
  int points = 0;
  struct View {
    double squares_px2 = 0;
    int points = 0;
  };
  std::vector<View> views;  ///< by placement, in an order that no name or number changes
};

/// Sets to 0 what the fit's lens and board do not have.
void clear_unused(JointModel& model, const JointFit& fit);

/// Leaves out one group of placements after the other (`groups` of them; one stays, which holds the
/// world, the same whatever the views' order).
[[nodiscard]] HeldOut held_out_error(const JointModel& solved, JointFit fit, int groups);

/// Index of the smallest lens (board) whose held-out error no larger one betters by more than the
/// standard error of the difference (Breiman et al. 1984; bootstrap over placements, fixed seed). A
/// term that is real is taken, however small it is against the noise of one point, for its bias is
/// common to thousands of them.
[[nodiscard]] std::size_t choose(const std::vector<HeldOut>& table);

/// Probability that each lens (board) has the least held-out error, were the placements drawn again
/// from those there are; by the order of `table`, sum 1. Not how often choose() would take it: on
/// real boards the intervals of that hold less (half_split_test).
[[nodiscard]] std::vector<double> probabilities(const std::vector<HeldOut>& table);

/// Distance (px) of a point from its image; infinite where it does not project.
[[nodiscard]] double distance_px(const JointModel& model, const JointFrame& frame,
                                 const TargetPoint& point);

}  // namespace drape::calib

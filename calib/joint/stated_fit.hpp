// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "calib/joint/covariance.hpp"
#include "calib/joint/fit.hpp"
#include "calib/joint/view_scatter.hpp"

namespace drape::calib {

/// A fit and the covariance that may be stated for it, in file units.
struct StatedFit {
  JointSolution solution;
  JointCovariance covariance;
  ViewScatter scatter;
};

/// Weighted sum of squares over the degrees of freedom.
[[nodiscard]] double chi2_per_dof(const JointSolution& solution, const JointFit& fit);

/// Covariance by the views' scatter, with what the choice of the lens leaves open: the other
/// lenses' covariances and distances, by the probability that other views would have chosen them
/// (Buckland, Burnham and Augustin 1997). `table` is empty where the lens was not chosen.
[[nodiscard]] StatedFit with_lens_choice(const JointSolution& solution, const JointFit& fit,
                                         const JointCleaning& cleaning,
                                         const std::vector<HeldOut>& table);

}  // namespace drape::calib

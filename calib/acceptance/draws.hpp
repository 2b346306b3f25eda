// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/acceptance/positions.hpp"

namespace drape::calib {

/// U of every figure holds this part of faultless instruments (k = 2 of a normal distribution).
inline constexpr double kCoverage = 0.9545;

/// Draws of what calibration and noise do to measured points (JCGM 101), the same for all figures:
/// one draw of the calibration's error goes through all points of all positions. Fixed seeds.
class Draws {
 public:
  /// `covariance`: of the cameras' parameters; empty when none is stated.
  Draws(const Eigen::MatrixXd& covariance, int count);
  [[nodiscard]] int count() const { return count_; }
  /// The calibration's covariance is root() root()', and its drawn errors are root() z.
  [[nodiscard]] const Eigen::MatrixXd& root() const { return root_; }

  /// Errors (mm) of the points, three rows a point, one column a draw. `noise_variance`: of the
  /// detections over what they state. `seed`: one for each position.
  [[nodiscard]] Eigen::MatrixXd errors_mm(const std::vector<const MeasuredPoint*>& points,
                                          double noise_variance, unsigned seed) const;
  /// Standard normal numbers, one a draw.
  [[nodiscard]] Eigen::RowVectorXd standard_normal(unsigned seed) const;

 private:
  int count_;
  Eigen::MatrixXd root_, unit_;
};

/// A figure on instruments without a fault.
struct Faultless {
  double expanded = 0;  ///< U: kCoverage of them stay within
  double largest = 0;   ///< only `false_no_go` of them exceed it
};

/// From draws of a figure that is the largest of several errors: the extreme by Gumbel's
/// distribution of the draws' mean and standard deviation (Gumbel 1958).
[[nodiscard]] Faultless faultless_of(std::vector<double> draws, double false_no_go);

/// The largest of `count` normal errors with this standard deviation (Sidak 1967).
[[nodiscard]] Faultless faultless_of_normal(double sd, int count, double false_no_go);

/// The value of chi2 / dof that only `p` exceed.
[[nodiscard]] double chi2_per_dof_beyond(int dof, double p);

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/acceptance/positions.hpp"

namespace drape::calib {

/// Fraction of faultless instruments within U (k = 2 of a normal distribution).
inline constexpr double kCoverage = 0.9545;

/// Draws of the effect of calibration error and noise on measured points (JCGM 101), shared by all
/// figures: one draw of the calibration error applies to all points of all positions. Fixed seeds.
class Draws {
 public:
  /// `covariance` is that of the cameras' parameters; empty if none is stated.
  Draws(const Eigen::MatrixXd& covariance, int count);
  [[nodiscard]] int count() const { return count_; }
  /// Root of the calibration's covariance, root() root()'; errors are drawn as root() z.
  [[nodiscard]] const Eigen::MatrixXd& root() const { return root_; }

  /// Errors (mm) of the points, three rows per point, one column per draw. `noise_variance` is that
  /// of the detections over the stated one. `seed` must differ between positions.
  [[nodiscard]] Eigen::MatrixXd errors_mm(const std::vector<const MeasuredPoint*>& points,
                                          double noise_variance, unsigned seed) const;
  /// Standard normal numbers, one per draw.
  [[nodiscard]] Eigen::RowVectorXd standard_normal(unsigned seed) const;

 private:
  int count_;
  Eigen::MatrixXd root_, unit_;
};

/// Distribution of a figure over faultless instruments.
struct Faultless {
  double expanded = 0;  ///< U: a fraction of kCoverage stays within
  double largest = 0;   ///< exceeded with probability `false_no_go` only
};

/// For draws of a figure that is the largest of several errors: the extreme from a Gumbel
/// distribution with the mean and standard deviation of the draws (Gumbel 1958).
[[nodiscard]] Faultless faultless_of(std::vector<double> draws, double false_no_go);

/// For the largest of `count` normal errors with this standard deviation (Sidak 1967).
[[nodiscard]] Faultless faultless_of_normal(double sd, int count, double false_no_go);

/// The value of chi2 / dof that is exceeded with probability `p`.
[[nodiscard]] double chi2_per_dof_beyond(int dof, double p);

}  // namespace drape::calib

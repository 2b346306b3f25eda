// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// False-alarm probability of each of the three tests of a rig: 1 in 1,000 for all together.
inline constexpr double kFalseAlarms = 1e-3 / 3;

/// Additional parameters of a fit, estimated with all others to first order.
struct MoreParameters {
  Eigen::VectorXd estimate;    ///< empty if the views cannot determine them
  Eigen::MatrixXd covariance;  ///< from the scatter between views
  double p = 1;                ///< probability of a larger deviation from 0 (Hotelling 1931)
  double explained = 0;        ///< decrease of the weighted sum of squares
  Eigen::MatrixXd others;      ///< change of the other parameters without each, per unit

  /// Change of all parameters of the views' information, these last.
  [[nodiscard]] Eigen::VectorXd step() const;
};

/// `views` comes from information_by_view() with the additional parameters last.
[[nodiscard]] MoreParameters fit_more(const ViewsInformation& views, Eigen::Index count);

}  // namespace drape::calib

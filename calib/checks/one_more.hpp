// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// Probability that one of the three tests accuses a rig without a fault: 1 in 1,000 by all.
inline constexpr double kFalseAlarms = 1e-3 / 3;

/// Parameters more than a fit has, all others fitted along, to first order.
struct MoreParameters {
  Eigen::VectorXd estimate;    ///< empty where the views cannot tell
  Eigen::MatrixXd covariance;  ///< by the views' own scatter
  double p = 1;                ///< probability of all as far from 0 (Hotelling 1931)
  double explained = 0;        ///< decrease of the weighted sum of squares
  Eigen::MatrixXd others;      ///< motion of the other parameters without each, per unit

  /// Change of all parameters of the views' information, these last.
  [[nodiscard]] Eigen::VectorXd step() const;
};

/// `views` by information_by_view() with those parameters last.
[[nodiscard]] MoreParameters fit_more(const ViewsInformation& views, Eigen::Index count);

}  // namespace drape::calib

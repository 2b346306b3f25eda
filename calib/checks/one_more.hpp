// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calib/joint/solve.hpp"

namespace drape::calib {

/// How often a rig without a fault is accused by one of the three tests: 1 in 1,000 by all.
inline constexpr double kFalseAlarms = 1e-3 / 3;

/// One parameter more than a fit has, all others fitted along.
struct OneMore {
  double estimate = 0;
  double p = 1;            ///< probability of one as far from 0, by the views' own scatter
  double explained = 0;    ///< of the weighted sum of squares
  Eigen::VectorXd others;  ///< how far the other parameters move without it, per unit
};

/// `views` by information_by_view() with that parameter last.
[[nodiscard]] OneMore one_more(const std::vector<ViewInformation>& views);

}  // namespace drape::calib

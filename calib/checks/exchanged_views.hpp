// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// Two cameras whose pictures are exchanged in some sets against the others: what to say of it,
/// empty where there are none. `all`: every view; `started`: the cameras as most views place them.
[[nodiscard]] std::string exchanged_views(const JointModel& all, const JointModel& started);

}  // namespace drape::calib

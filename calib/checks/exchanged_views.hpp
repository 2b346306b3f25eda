// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// Message about two cameras whose pictures are exchanged in some sets; empty if there are none.
/// `all` holds every view; `started` the cameras as located by the majority of views.
[[nodiscard]] std::string exchanged_views(const JointModel& all, const JointModel& started);

}  // namespace drape::calib

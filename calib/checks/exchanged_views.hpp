// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "calib/joint/model.hpp"

namespace drape::calib {

/// Message about two cameras whose pictures are exchanged in some sets; empty if there are none.
/// `all` holds every view; `started` the cameras as located by the majority of views.
[[nodiscard]] std::string exchanged_views(const JointModel& all, const JointModel& started);

/// Reason why the labels of a target with half-turn symmetry are not confirmed: a picture agrees
/// with another one of its set only with rotated labels, or a camera is connected to the others by
/// a single common view, which agrees either way. Empty if they are confirmed.
[[nodiscard]] std::string unconfirmed_labels(const Target& target, const JointModel& all,
                                             const JointModel& started);

}  // namespace drape::calib

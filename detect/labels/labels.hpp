// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/marks.hpp"
#include "detect/dots/blobs.hpp"
#include "detect/dots/local_map.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// Label of a dot, or why it has none. A dot can have both: a label that was
/// withdrawn, with the reason.
struct DotLabel {
  std::optional<MarkId> mark;
  std::string reason;  ///< empty when the label stands
};

/// Labels dots from the tags beside them and from labelled neighbours, best fit first. A step is
/// taken only when it fits the trapezoid rule of both local maps and no other dot fits nearly as
/// well; a label must agree with its labelled neighbours and with where tags are and are not
/// around it. Answers in the order of `dots`.
[[nodiscard]] std::vector<DotLabel> label_dots(const PrintPlane& plane,
                                               const std::vector<TagDetection>& tags,
                                               const std::vector<UnlabelledDot>& dots,
                                               const DarkMap& map);

}  // namespace drape::detect

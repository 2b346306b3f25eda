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

/// Label of a dot, or the reason why it has none. A dot can have both: a label that was withdrawn,
/// and the reason.
struct DotLabel {
  std::optional<MarkId> mark;
  std::string reason;  ///< empty if the label is valid
};

/// Labels dots, best match first, from adjacent tags and from labelled neighbours. A step is
/// accepted only if it satisfies the trapezoidal rule with both local maps and no other dot matches
/// nearly as well; a label must agree with labelled neighbours and with where tags are present or
/// absent around it. The result is in the order of `dots`.
[[nodiscard]] std::vector<DotLabel> label_dots(const PrintPlane& plane,
                                               const std::vector<TagDetection>& tags,
                                               const std::vector<UnlabelledDot>& dots,
                                               const DarkMap& map);

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// Why the tags of a picture cannot lie where the print says; empty where they can. Two tags are
/// never farther apart in a picture than on the print, at the scale of the nearest tag; and each
/// tag says by its own corners in which direction the others lie. `file` is the print's or
/// target's.
[[nodiscard]] std::string tags_elsewhere(const PrintPlane& plane,
                                         const std::vector<TagDetection>& tags,
                                         const std::string& file);

}  // namespace drape::detect

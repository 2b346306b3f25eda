// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "triangulate/plate/object_pose.hpp"

namespace drape::triangulate {

/// Text of a scene file in which object number `object` (from 1) has the place shown by its plate
/// and the measured place_uncertainty_mm, without its `tags_` keys. File names are relative to
/// `folder`. Everything else stays as written. Throws Error(bad_input) if a value of the object is
/// not on a line of its own.
[[nodiscard]] std::string measured_scene(const std::filesystem::path& scene, std::size_t object,
                                         const std::vector<ObjectValue>& values,
                                         const std::filesystem::path& folder);

/// Throws Error(usage) if `file` exists and is not a measured scene, since it may be hand-written.
void require_own_scene(const std::filesystem::path& file);

}  // namespace drape::triangulate

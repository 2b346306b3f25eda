// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "triangulate/plate/object_pose.hpp"

namespace drape::triangulate {

/// The text of a scene file with object number `object` (from 1) where its plate shows it and
/// place_uncertainty_mm as measured; the object's `tags_` keys are left out. Names of files are
/// given from `folder`. All else stays as it is written. Throws Error(bad_input) where a value of
/// the object is not on a line of its own.
[[nodiscard]] std::string measured_scene(const std::filesystem::path& scene, std::size_t object,
                                         const std::vector<ObjectValue>& values,
                                         const std::filesystem::path& folder);

/// Throws Error(usage) where `file` is there and no measured scene: it may be a scene by hand.
void require_own_scene(const std::filesystem::path& file);

}  // namespace drape::triangulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "core/rig.hpp"

namespace drape::detect {

/// A square sheet of dots with tags that lies on a box's top or carries a sphere, as large as asked
/// (metres), half a pitch of white around the dots. Its four tags, `first_id` to `first_id` + 3,
/// lie in the corner cells. Throws Error(usage) for less than 45 mm.
[[nodiscard]] Target object_plate(double size_m, int first_id);

/// The plate's description, as read_target() reads it.
[[nodiscard]] std::string object_plate_toml(const Target& plate);

/// Throws Error(bad_input) where `file` is there and is not, byte for byte, what the run that
/// `record` tells of wrote: the target of a rig, or a description that was corrected since.
void require_replaceable_plate(const std::filesystem::path& file,
                               const std::filesystem::path& record);

}  // namespace drape::detect

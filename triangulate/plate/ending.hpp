// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/program/program.hpp"
#include "triangulate/plate/object_pose.hpp"

namespace drape::triangulate {

/// One sentence for each value that contradicts the scene; `name` is the object's.
[[nodiscard]] std::vector<std::string> contradictions_of(const std::vector<ObjectValue>& values,
                                                         const std::string& name);

/// Ending of the measurement, NO-GO if something contradicts it; `name` is the object's.
[[nodiscard]] Ending ending_of(const std::vector<ObjectValue>& values, const PlatePose& plate,
                               const std::string& name, const std::vector<std::string>& against);

}  // namespace drape::triangulate

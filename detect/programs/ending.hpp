// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/program/program.hpp"
#include "detect/detect.hpp"

namespace drape::detect {

/// The last lines of drape-detect; `is_plate`: of the target that an object carries, not the rig's.
[[nodiscard]] Ending ending_of(const DetectReport& report, Surface surface, bool is_plate,
                               const std::string& out);

}  // namespace drape::detect

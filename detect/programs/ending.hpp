// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/program/program.hpp"
#include "detect/detect.hpp"

namespace drape::detect {

/// The last lines of drape-detect: NO-GO when a frame shows no mark at all.
[[nodiscard]] Ending ending_of(const DetectReport& report, Surface surface, const std::string& out);

}  // namespace drape::detect

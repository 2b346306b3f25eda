// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "calib/joint.hpp"
#include "core/program/program.hpp"

namespace drape::calib {

/// Verdict, numbers, rejections and next command of a joint calibration, for people.
[[nodiscard]] Ending ending_of(const JointResult& result, const std::filesystem::path& out);

}  // namespace drape::calib

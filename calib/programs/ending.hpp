// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "calib/calib.hpp"
#include "core/program/program.hpp"

namespace drape::calib {

/// What the operator reads after a calibration: verdict, figures of each camera, rejections.
[[nodiscard]] Ending ending_of(const CalibResult& result, const std::filesystem::path& out);

}  // namespace drape::calib

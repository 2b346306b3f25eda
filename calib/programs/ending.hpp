// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <optional>
#include "calib/calib.hpp"
#include "calib/joint.hpp"
#include "core/calibration.hpp"
#include "core/program/program.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Ending of a calibration by Tsai's method: verdict, figures of each camera, rejections.
[[nodiscard]] Ending ending_of(const CalibResult& result, const std::filesystem::path& out);

/// Ending of a joint calibration: verdict, numbers, rejections and next command.
[[nodiscard]] Ending ending_of(const JointResult& result, const std::filesystem::path& out);

/// Adds the results of --compare: drift of each camera since `old` in the volume from the target
/// to its highest stage, with a warning if it exceeds the stated uncertainties or if `old` is
/// NO-GO.
void add_drift(Ending& ending, const Calibration& old, const Calibration& now, const Rig& rig,
               const Target& target);

/// The next command after a successful calibration.
[[nodiscard]] std::string next_command(const std::filesystem::path& calibration);

}  // namespace drape::calib

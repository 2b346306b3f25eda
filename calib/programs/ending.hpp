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

/// Verdict, numbers, rejections and next command of a joint calibration, for people.
[[nodiscard]] Ending ending_of(const JointResult& result, const std::filesystem::path& out);

/// Lines of --compare: how far each camera drifted since `old` over the target and up to its
/// highest stage, and a warning for each that drifted by more than the stated uncertainties, and
/// where `old` is NO-GO.
void add_drift(Ending& ending, const Calibration& old, const Calibration& now, const Rig& rig,
               const Target& target);

/// The step that follows a good calibration.
[[nodiscard]] std::string next_command(const std::filesystem::path& calibration);

}  // namespace drape::calib

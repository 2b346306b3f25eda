// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/calibration.hpp"
#include "core/program/program.hpp"
#include "core/rig.hpp"

namespace drape::calib {

/// Lines of --compare: how far each camera drifted since `old` over the target and up to its
/// highest stage, and a warning for each that drifted by more than the stated uncertainties, and
/// where `old` is NO-GO.
void add_drift(Ending& ending, const Calibration& old, const Calibration& now, const Rig& rig,
               const Target& target);

}  // namespace drape::calib

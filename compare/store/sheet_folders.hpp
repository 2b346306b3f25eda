// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace drape::compare {

/// Files stay as they are given; a folder becomes the sheets below it, in the order that
/// read_session() wants: first the simulations that stand alone (a virtual bench), then each
/// measured sheet with what lies in the folders `simulations` and `branches` beside it, by name,
/// then what the lists of `refined` and `ensemble` name, as `drape run` compares them. Links are
/// not followed. Throws Error(usage) when there is no sheet at all, and Error(bad_input) for a run
/// record or list whose sheet is gone.
[[nodiscard]] std::vector<std::filesystem::path> sheets_in(
    const std::vector<std::filesystem::path>& given);

/// The repeats of those measured sheets that have simulations: the `repeats` folder beside each.
[[nodiscard]] std::vector<std::filesystem::path> repeats_in(
    const std::vector<std::filesystem::path>& given);

/// The one calibration.json that lies in a given folder itself; empty when there is none, or more
/// than one (then only sheets that name the same one could be read).
[[nodiscard]] std::filesystem::path calibration_in(const std::vector<std::filesystem::path>& given);

}  // namespace drape::compare

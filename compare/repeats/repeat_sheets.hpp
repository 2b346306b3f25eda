// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/sheet_file.hpp"

namespace drape::compare {

/// Throws Error(bad_input) naming a file that is not a laying or simulation of the others' drape: a
/// simulation among the repeats, a measured sheet among the virtual ones, another scene, print,
/// calibration or upper face, or a copy of another file. A laying that does not state its drape
/// must be the one that positioned a simulation.
void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets);

/// Reasons, one per sheet, why results based on them are NO-GO: a NO-GO measurement, or a
/// simulation that is not at rest.
[[nodiscard]] std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets);

/// Pairs of frame sets in which identical layings are searched for.
enum class Among { one_drape, different_drapes };

/// Finds measured sheets that show the same laying in different frame sets, with the reason, by the
/// SHA-256 of both: half of at least ten common marks agree within the 99.5 % quantile of chi
/// square (three degrees of freedom, both covariances). A new laying would differ by millimetres.
[[nodiscard]] std::map<std::string, std::string> layings_twice(
    const std::vector<const SheetFile*>& sheets, Among pairs);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/sheet_file.hpp"

namespace drape::compare {

/// Throws Error(bad_input) naming the file that is no laying or simulation of the others' drape: a
/// simulation among the repeats, a measured sheet among the virtual ones, another scene, print,
/// calibration or upper face, or a copy of another. A laying that does not say whose it is must be
/// the one that placed a simulation.
void require_one_drape(const std::vector<SheetFile>& repeats,
                       const std::vector<SheetFile>& virtual_sheets);

/// Why what rests on these sheets is NO-GO: measurements that are, simulations that are not at
/// rest. A line per sheet.
[[nodiscard]] std::vector<std::string> no_go_of(const std::vector<SheetFile>& sheets);

/// Pairs of frame sets in which a laying is looked for twice.
enum class Among { one_drape, different_drapes };

/// Why a measured sheet shows the laying of another frame set, by the SHA-256 of both: half of at
/// least ten marks that both have agree within chi square's upper half per cent (three degrees of
/// freedom, both covariances). Cloth that is laid again lies millimetres off.
[[nodiscard]] std::map<std::string, std::string> layings_twice(
    const std::vector<const SheetFile*>& sheets, Among pairs);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/repeats/mark_repeats.hpp"

namespace drape::compare {

/// A sheet file, and what it says of the drape that it is a laying or a simulation of.
struct RepeatSheet {
  NamedSheet named;
  std::optional<std::string> scene;  ///< absent of a measured sheet without `source.repeat`
  std::string face;                  ///< the side of the cloth that lies up, where it is stated
  std::string sha256, ply_sha256;    ///< of <stem>.json and <stem>.ply
};
[[nodiscard]] RepeatSheet read_repeat_sheet(const std::filesystem::path& file);

/// Throws Error(bad_input) naming the file that is no laying or simulation of the others' drape: a
/// simulation among the repeats, a measured sheet among the virtual ones, another scene, print,
/// calibration or upper face, or a copy of another. A laying that does not say whose it is must be
/// the one that placed a simulation.
void require_one_drape(const std::vector<RepeatSheet>& repeats,
                       const std::vector<RepeatSheet>& virtual_sheets);

/// Why what rests on these sheets is NO-GO: measurements that are, simulations that are not at
/// rest. A line per sheet.
[[nodiscard]] std::vector<std::string> no_go_of(const std::vector<RepeatSheet>& sheets);

}  // namespace drape::compare

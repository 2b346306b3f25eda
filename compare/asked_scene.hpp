// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/repeats/sheet_file.hpp"

namespace drape::compare {

/// The scene that a simulation read, where its file is still the same.
struct SimulatedScene {
  std::string set;  ///< frame set of the recording that shows it; may be empty
  Surroundings surroundings;
  double friction = 0;
  bool own_fabric = false;  ///< the fabric that the scene names was simulated
};

/// `scene` has the content that was simulated; `inputs` are files with their SHA-256 as the run
/// read them, a mesh among them. Nothing where they do not name a mesh of the scene.
[[nodiscard]] std::optional<SimulatedScene> read_simulated_scene(
    const std::filesystem::path& scene,
    const std::vector<std::pair<std::filesystem::path, std::string>>& inputs);

/// Difference of solid and table in what a mark can touch, as a sentence: their stated
/// uncertainties and tags may differ. `in_other`: what the other is.
[[nodiscard]] std::optional<std::string> difference_of(
    const Surroundings& asked, const Surroundings& other,
    const std::string& in_other = "in the simulation");

}  // namespace drape::compare

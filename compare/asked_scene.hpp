// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "compare/repeats/sheet_file.hpp"

namespace drape::compare {

/// The scene used by a simulation, if its file has not changed since.
struct SimulatedScene {
  std::string set;  ///< frame set of the recording that shows the drape; can be empty
  Surroundings surroundings;
  double friction = 0;
  bool own_fabric = false;  ///< true if the simulated fabric is the one named by the scene
};

/// `scene` has the content that was simulated; `inputs` are the run's input files with their
/// SHA-256, including any mesh. nullopt if they do not contain a mesh of the scene.
[[nodiscard]] std::optional<SimulatedScene> read_simulated_scene(
    const std::filesystem::path& scene,
    const std::vector<std::pair<std::filesystem::path, std::string>>& inputs);

/// Describes how two scenes differ in solids and table, which marks can touch; stated uncertainties
/// and tags may differ. `in_other` names the other scene.
[[nodiscard]] std::optional<std::string> difference_of(
    const Surroundings& asked, const Surroundings& other,
    const std::string& in_other = "in the simulation");

}  // namespace drape::compare

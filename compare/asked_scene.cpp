// SPDX-License-Identifier: Apache-2.0
#include "compare/asked_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "core/files/files.hpp"
#include "core/scene.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

bool touches_a_mark(const std::string& key) {
  return !key.ends_with("_uncertainty_mm") && !key.ends_with(".on_stand") &&
         key.find(".tags_") == std::string::npos;
}

/// Value of a key; absent ones, such as a yaw or an edge radius, are 0.
std::string value_of(const Surroundings& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() || found->second.empty() ? "0" : found->second;
}

/// True if it is an input by path or content: a record may name a copy; files may change.
bool is_among(const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  const std::string sha256 = fs::is_regular_file(file) ? sha256_of_file(file) : std::string();
  return std::any_of(inputs.begin(), inputs.end(), [&](const auto& input) {
    return input.second == sha256 ||
           fs::weakly_canonical(input.first) == fs::weakly_canonical(file);
  });
}

}  // namespace

std::optional<SimulatedScene> read_simulated_scene(
    const fs::path& file, const std::vector<std::pair<fs::path, std::string>>& inputs) {
  // Read as it was used; today's rules apply where a scene is measured or simulated.
  const auto scene = read_record<Scene>(file);
  SimulatedScene simulated{scene.set, {}, scene.friction, is_among(scene.fabric_file, inputs)};
  bool are_meshes_known = true;
  simulated.surroundings = surroundings_of(scene, [&](const fs::path& mesh) {
    for (const auto& [input, sha256] : inputs)
      if (fs::weakly_canonical(input) == fs::weakly_canonical(mesh)) return sha256;
    are_meshes_known = false;
    return std::string();
  });
  return are_meshes_known ? std::optional(simulated) : std::nullopt;
}

std::optional<std::string> difference_of(const Surroundings& asked, const Surroundings& other,
                                         const std::string& in_other) {
  Surroundings all = asked;
  all.insert(other.begin(), other.end());
  for (const auto& [key, any] : all) {
    const std::string one = value_of(asked, key), its = value_of(other, key);
    if (!touches_a_mark(key) || one == its) continue;
    return fmt::format("{} is {} {}, {} for the marks", key, its, in_other, one);
  }
  return std::nullopt;
}

}  // namespace drape::compare

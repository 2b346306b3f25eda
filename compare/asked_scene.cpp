// SPDX-License-Identifier: Apache-2.0
#include "compare/asked_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <variant>

#include "core/files/files.hpp"
#include "core/files/toml_file.hpp"
#include "core/scene.hpp"

namespace drape::compare {
namespace {

namespace fs = std::filesystem;

bool is_of_surroundings(const std::string& key) {
  return key == "table_z_mm" || key.starts_with("object.");
}

bool touches_a_mark(const std::string& key) {
  return !key.ends_with("_uncertainty_mm") && !key.ends_with(".on_stand") &&
         key.find(".tags_") == std::string::npos;
}

/// A value that is left out is 0: a yaw, the radius of an edge.
std::string value_of(const Surroundings& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() || found->second.empty() ? "0" : found->second;
}

/// By its file's path or content: a record may name a copy, and a file may have changed since.
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
  const Scene scene = read_scene(file);
  SimulatedScene simulated{scene.set, {}, scene.friction, is_among(scene.fabric_file, inputs)};
  for (const auto& [key, value] : TomlTable::open(file, "scene").values())
    if (is_of_surroundings(key)) simulated.surroundings[key] = value;
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const auto* mesh = std::get_if<MeshObject>(&scene.obstacles[i]);
    if (mesh == nullptr) continue;
    const auto read = std::find_if(inputs.begin(), inputs.end(), [&](const auto& input) {
      return fs::weakly_canonical(input.first) == fs::weakly_canonical(mesh->file);
    });
    if (read == inputs.end()) return std::nullopt;
    simulated.surroundings[fmt::format("object.{}.file", i + 1)] = read->second;
  }
  return simulated;
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

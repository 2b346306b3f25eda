// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/scene_files.hpp"

#include <variant>

namespace drape::simulate {

namespace fs = std::filesystem;

std::vector<fs::path> files_of(const Scene& scene, const Fabric& fabric) {
  std::vector<fs::path> files = {scene.file};
  for (const fs::path& file : fabric.files()) files.push_back(file);
  files.push_back(scene.print_file);
  for (const Obstacle& obstacle : scene.obstacles) {
    if (const auto* mesh = std::get_if<MeshObject>(&obstacle)) files.push_back(mesh->file);
  }
  return files;
}

}  // namespace drape::simulate

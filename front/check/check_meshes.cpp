// SPDX-License-Identifier: Apache-2.0
#include "front/check/check.hpp"
#include "front/process.hpp"

namespace drape {

void check_meshes(const Scene& scene, BenchCheck& check) {
  int meshes = 0;
  for (const Obstacle& obstacle : scene.obstacles)
    if (std::holds_alternative<MeshObject>(obstacle)) ++meshes;
  if (meshes == 0) return;
  check.files += meshes;
  if (const auto error =
          error_of_stage("simulate", {scene.file.string(), "--check-objects", "--json"}))
    check.problems.push_back(*error);
}

}  // namespace drape

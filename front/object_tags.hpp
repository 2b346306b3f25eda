// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace drape {

/// The plate of tags of one object of a scene (`tags_set`, `tags_target` in its [[object]]): it was
/// photographed on the object before the cloth was laid.
struct ObjectTags {
  int object = 1;                ///< number in the scene, from 1
  std::string set;               ///< frame set that shows it
  std::filesystem::path target;  ///< its description (`drape print object-tags`)
  /// Options of `drape object` that say how it lies there, as they stand in the scene.
  std::vector<std::pair<std::string, double>> lies;
};

/// In the order of the objects. `scene` can be read by read_scene().
[[nodiscard]] std::vector<ObjectTags> object_tags_of(const std::filesystem::path& scene);

}  // namespace drape

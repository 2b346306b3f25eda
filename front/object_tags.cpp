// SPDX-License-Identifier: Apache-2.0
#include "front/object_tags.hpp"

#include "core/files/toml_file.hpp"

namespace drape {

std::vector<ObjectTags> object_tags_of(const std::filesystem::path& scene) {
  std::vector<ObjectTags> all;
  int object = 0;
  for (const TomlTable& table : TomlTable::open(scene, "scene").tables("object")) {
    ++object;
    if (!table.has("tags_set")) continue;
    ObjectTags& found = all.emplace_back();
    found.object = object;
    found.set = table.name("tags_set");
    found.target = table.file_path("tags_target");
    for (const auto& [key, option] :
         {std::pair{"tags_thickness_mm", "--thickness-mm"}, std::pair{"tags_hole_mm", "--hole-mm"},
          std::pair{"tags_placing_mm", "--placing-mm"}})
      if (table.has(key)) found.lies.emplace_back(option, table.number(key));
  }
  return all;
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "front/repeats.hpp"

#include "core/files/toml_file.hpp"

namespace drape {

std::vector<DrapeRepeat> repeats_of(const std::filesystem::path& rig) {
  std::vector<DrapeRepeat> all;
  for (const TomlTable& table : TomlTable::open(rig, "rig").tables("repeat")) {
    DrapeRepeat& one =
        all.emplace_back(DrapeRepeat{table.name("scene"), table.name("set"), {}, {}});
    one.repeat = table.has("repeat") ? table.name("repeat") : one.set;
    one.face = table.text_or("face", "");
  }
  return all;
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace drape {

/// One laying of a drape ([[repeat]] in rig.toml): the cloth of a scene laid again on the same
/// object, or, where its set is the scene's, what the scene's own laying is called.
struct DrapeRepeat {
  std::string scene;   ///< name of the scene
  std::string set;     ///< frame set that shows it
  std::string repeat;  ///< its name; the set's where none is given
  std::string face;    ///< side of the cloth that lies up; empty: not stated
};

/// In the order of the file. `rig` can be read by read_rig().
[[nodiscard]] std::vector<DrapeRepeat> repeats_of(const std::filesystem::path& rig);

}  // namespace drape

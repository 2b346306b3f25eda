// SPDX-License-Identifier: Apache-2.0
#include "detect/programs/places.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"

namespace drape::detect {

namespace fs = std::filesystem;

void require_apart(const fs::path& recording, const fs::path& out, const fs::path& overlays) {
  const fs::path folder =
      fs::weakly_canonical(fs::absolute(recording / "recording.json")).parent_path();
  const auto is_inside = [&](const fs::path& place) {
    const fs::path real = fs::weakly_canonical(fs::absolute(place));
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first ==
           folder.end();
  };
  for (const auto& [option, place] : {std::pair("--out", out), std::pair("--overlay", overlays)})
    if (!place.empty() && is_inside(place))
      throw usage_error(fmt::format("{} {} lies inside the recording {}", option, place.string(),
                                    recording.string()),
                        "give a place outside: a recording stays as it was taken");
  if (!overlays.empty() && fs::exists(overlays) && !fs::is_directory(overlays))
    throw bad_input("a file stands where a folder is to be made", {.file = overlays.string()},
                    "give --overlay another place");
}

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/figure4/sphere_drape.hpp"

namespace drape::test {

struct Panel {
  std::string title, note;
  SphereDrape drape;
};

/// Panels side by side: above, the shaded sheet over its sphere; below, its hem from above (black)
/// and the hem's mirror image u -> -u (red), which lies under it where the drape is symmetric.
[[nodiscard]] std::string svg_of(const std::vector<Panel>& panels, const Sphere& sphere);

}  // namespace drape::test

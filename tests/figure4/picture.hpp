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
/// and the mirror image u -> -u of the hem (red), which is hidden under it for a symmetric drape.
[[nodiscard]] std::string svg_of(const std::vector<Panel>& panels, const Sphere& sphere);

}  // namespace drape::test

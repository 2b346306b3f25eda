// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "detect/prints/page.hpp"

namespace drape::detect {

/// What a printed tag looks like.
struct TagLook {
  std::string family;
  double edge_m = 0;       ///< of its black square
  int border_modules = 1;  ///< of the black rim around its bits
};

/// The black modules of an AprilTag, upright around a centre. The bits are those of the AprilTag 3
/// library; upright is what OpenCV draws and the detector reads, half a turn from the library's own
/// pictures. Throws Error(bad_input) for a family that is not known or has no such id.
[[nodiscard]] PageArea tag_on_page(const TagLook& look, int id, const Eigen::Vector2d& centre_m);

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "detect/print_page.hpp"

namespace drape {

/// The black modules of an AprilTag whose black square has this edge, upright around a centre. The
/// bits are those of the AprilTag 3 library; upright is what OpenCV draws and the detector reads,
/// half a turn from the library's own pictures. Throws Error(bad_input) for a family that is not
/// known or has no such id.
[[nodiscard]] PageArea tag_on_page(const std::string& family, int id, double edge_m,
                                   const Eigen::Vector2d& centre_m);

}  // namespace drape

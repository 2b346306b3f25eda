// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "synth/render/face_pattern.hpp"

namespace drape::synth {

/// The black modules of an upright tag whose black square has this edge. The bits are those of the
/// AprilTag 3 library. Throws Error(bad_input) for an unknown family or id.
[[nodiscard]] std::vector<Rectangle> tag_modules(const std::string& family, int id, double edge_m,
                                                 const FacePoint& centre);

}  // namespace drape::synth

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/scene.hpp"
#include "triangulate/guards/object_fit.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// Detection limit of each box and sphere: the smallest error of its height, diameter or width, or
/// rotation that the marks of this drape would contradict (contradictions_of_objects()), in the
/// least visible direction. The stated object is changed until it is contradicted, by up to half of
/// its width, or 45 degrees.
[[nodiscard]] std::vector<Unseen> detection_limits(const SeenCloth& seen, const Scene& scene);

}  // namespace drape::triangulate

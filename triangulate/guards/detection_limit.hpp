// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/scene.hpp"
#include "triangulate/guards/object_fit.hpp"
#include "triangulate/triangulate.hpp"

namespace drape::triangulate {

/// For each box and sphere: how far it may be wrong beside its place, in the height of its top, in
/// its diameter or width, or turned, before the marks of this drape contradict it
/// (contradictions_of_objects()), in the direction that is seen worst. The object is changed from
/// how it is stated until it is named: by half of its width, 45 degrees.
[[nodiscard]] std::vector<Unseen> detection_limits(const SeenCloth& seen, const Scene& scene);

}  // namespace drape::triangulate

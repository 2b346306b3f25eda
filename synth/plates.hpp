// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/pose.hpp"
#include "core/scene.hpp"

namespace drape::synth {

/// A plate of object tags (`tags_set` in an [[object]] of a scene), exactly where it belongs: edge
/// on edge on a box's top, or as the stand whose hole carries a sphere.
struct Plate {
  std::string set;
  std::filesystem::path target;
  WorldFromTarget pose;
};

/// Throws Error(bad_input) where neither a box nor a sphere in its hole can carry the plate.
[[nodiscard]] std::vector<Plate> plates_of(const Scene& scene);

}  // namespace drape::synth

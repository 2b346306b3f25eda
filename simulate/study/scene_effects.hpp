// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/scene.hpp"
#include "simulate/study/sensitivity.hpp"

namespace drape::simulate {

/// How the mean distance from the reference answers to a measured value of the scene.
struct SceneEffect {
  /// "friction", "object_1_x_mm", "object_1_size_mm"; "internal_friction" (of the fabric): 0
  /// without, 1 with, -1 as far in the other direction
  std::string value;
  std::optional<double> change_per_unit;  ///< m per unit; absent when a drape did not come to rest
  MarkMoves moves;
};

/// Where the marks of a drape come to rest, one row each (m, world), and their mean distance from
/// the reference (m).
struct RestedMarks {
  Eigen::MatrixX3d places_m;
  double distance_m = 0;
};

/// Drapes the scene with one value changed by its standard uncertainty, up and down: place (x, y,
/// z) and size of each object, and friction; a stand-in by its half-width. `drape` gives nothing
/// where the cloth does not come to rest; `base_m`: where the marks lie on the unchanged drape.
[[nodiscard]] std::vector<SceneEffect> scene_effects(
    const Scene& scene, const std::function<std::optional<RestedMarks>(const Scene&)>& drape,
    const Eigen::MatrixX3d& base_m);

/// Array of {value, mean_distance_mm_per_unit, step, down_mm, up_mm}, without the absent ones.
[[nodiscard]] Json scene_effects_json(const std::vector<SceneEffect>& effects);

}  // namespace drape::simulate

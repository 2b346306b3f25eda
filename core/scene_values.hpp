// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/scene.hpp"

namespace drape {

/// Uncertainty of a value: standard, or, if rectangular, the half-widths below and above it.
struct ValueWidth {
  double down = 0, up = 0;  ///< in the value's unit; per cent of a fabric value
  bool rectangular = false;
  std::string origin, remedy;
};

/// An uncertain value of a scene, with its name in sensitivity.json.
struct SceneValue {
  std::string name;
  ValueWidth width;
};

/// Lists them: level of the bench, positions of pins, clamps and objects, sizes, friction. `pin_m`:
/// standard uncertainty of a pin whose position is that of its measured mark.
[[nodiscard]] std::vector<SceneValue> values_of(const Scene& scene,
                                                const std::function<double(const Pin&)>& pin_m);

/// Errors of stated values by name, each in its own unit. Besides the names of values_of():
/// start_x_mm, start_y_mm and start_yaw_deg of a flat start.
using ValueErrors = std::map<std::string, double>;
/// Error with this name; 0 if there is none.
[[nodiscard]] double error_of(const ValueErrors& errors, const std::string& name);
/// The scene with these errors in its stated values, in the frame of its file.
[[nodiscard]] Scene erring(Scene scene, const ValueErrors& errors);

/// The object shifted by `by_m`.
[[nodiscard]] Obstacle moved(Obstacle object, const Eigen::Vector3d& by_m);
/// The object with each of its sizes increased by a length, its base unchanged. Planes and meshes
/// have no size of their own.
[[nodiscard]] Obstacle grown(Obstacle object, double by_m);

}  // namespace drape

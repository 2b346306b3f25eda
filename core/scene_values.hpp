// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/scene.hpp"

namespace drape {

/// Uncertainty of one value: its standard uncertainty, or how far its range reaches down and up.
struct ValueWidth {
  double down = 0, up = 0;  ///< in the value's unit; per cent of a fabric value
  bool rectangular = false;
  std::string origin, remedy;
};

/// A value of a scene that errs, by the name that drape simulate gives it (sensitivity.json).
struct SceneValue {
  std::string name;
  ValueWidth width;
};

/// Level of the bench, places of pins, clamps and objects, sizes, friction. `pin_m`: standard
/// uncertainty of a pin that is where its mark was measured.
[[nodiscard]] std::vector<SceneValue> values_of(const Scene& scene,
                                                const std::function<double(const Pin&)>& pin_m);

/// Errors of stated values by name, each in its own unit. Names beyond those of values_of():
/// start_x_mm, start_y_mm and start_yaw_deg of a flat start.
using ValueErrors = std::map<std::string, double>;
/// The error of that name; 0 where there is none.
[[nodiscard]] double error_of(const ValueErrors& errors, const std::string& name);
/// The scene with its values stated wrongly by these errors, in the frame of its file.
[[nodiscard]] Scene erring(Scene scene, const ValueErrors& errors);

/// The object elsewhere.
[[nodiscard]] Obstacle moved(Obstacle object, const Eigen::Vector3d& by_m);
/// The object larger by a length in each of its sizes, standing where it stood. Planes and meshes
/// have no size of their own.
[[nodiscard]] Obstacle grown(Obstacle object, double by_m);

}  // namespace drape

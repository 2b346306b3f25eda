// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// A scene in the frame of its sheet: origin at the centre of the start, x along the weft, z up.
/// Coordinates are small there, and a world that is shifted or rotated about the vertical gives
/// identical numbers: positions of objects and pins are rounded to 0.12 nm, far above the rounding
/// of world coordinates and far below any measurement.
struct LocalScene {
  Scene scene;
  std::optional<Sheet> measured;
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;  ///< angle of the local x axis in the world
  StartReport placed;  ///< placement of the flat start

  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const;
  /// Converts a point, with the rounding used for objects.
  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& world) const;
  /// Gravity energy of `mass_kg` in the world frame minus that in this frame (J).
  [[nodiscard]] double gravity_offset_j(double mass_kg) const;
};

/// Transforms a scene; `top_z_m` is the highest point of the objects. Throws like flat_start().
[[nodiscard]] LocalScene local_scene(const Scene& world, const std::optional<Sheet>& measured,
                                     double top_z_m);

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/start/start.hpp"

namespace drape::simulate {

/// A scene in the frame of its sheet: origin at the middle of the start, x along the weft, z up.
/// There every coordinate is small, and a world that is moved or turned about the vertical gives
/// the same numbers: places of objects and pins are rounded to 0.12 nm, far above the rounding of
/// world coordinates and far below what anybody measures.
struct LocalScene {
  Scene scene;
  std::optional<Sheet> measured;
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();
  double yaw_rad = 0;  ///< angle of the local x axis in the world
  StartReport placed;  ///< placement of the flat start, in the world

  [[nodiscard]] Eigen::Vector3d to_world(const Eigen::Vector3d& local) const;
  /// Rounded as places of objects are.
  [[nodiscard]] Eigen::Vector3d to_local(const Eigen::Vector3d& world) const;
  /// Energy of `mass_kg` under gravity in the world frame less that in this one (J).
  [[nodiscard]] double gravity_offset_j(double mass_kg) const;
};

/// `top_z_m` is the highest point of the objects in the world. Throws Error as flat_start() does.
[[nodiscard]] LocalScene local_scene(const Scene& world, const std::optional<Sheet>& measured,
                                     double top_z_m);

}  // namespace drape::simulate

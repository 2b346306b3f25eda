// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "core/camera_model.hpp"
#include "core/units.hpp"

namespace drape::test {

/// A camera 780 mm from the origin that faces it, tilted from the vertical.
inline Camera synthetic_camera(const std::string& name, double azimuth_deg, double tilt_deg) {
  const double azimuth = azimuth_deg * units::deg, tilt = tilt_deg * units::deg;
  const Eigen::Vector3d from =
      0.78 * Eigen::Vector3d(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                             std::cos(tilt));
  const Eigen::Vector3d z = -from.normalized();
  const Eigen::Vector3d away = tilt_deg == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d x = z.cross(away).normalized();
  Camera camera;
  camera.name = name;
  camera.cam_from_world.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  camera.cam_from_world.translation_m = -camera.cam_from_world.rotation * from;
  camera.model = {BrownLens{3100, 3103, 805, 596, -0.14, 0.02, 0, 0, 0}, 1600, 1200};
  return camera;
}

/// Three cameras around the cloth with equal tilt.
inline std::vector<Camera> three_synthetic_cameras(double tilt_deg) {
  return {synthetic_camera("cam0", -120, tilt_deg), synthetic_camera("cam1", 0, tilt_deg),
          synthetic_camera("cam2", 120, tilt_deg)};
}

}  // namespace drape::test

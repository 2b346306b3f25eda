// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "core/units.hpp"
#include "triangulate/point.hpp"

namespace drape::test {

using namespace triangulate;

/// A camera 700 mm from the origin, facing it from an azimuth, 45 degrees above the horizontal.
inline CalibratedCamera camera_at(double azimuth_deg, bool tsai, const std::string& name) {
  const double azimuth = azimuth_deg * units::deg;
  const Eigen::Vector3d from(std::cos(azimuth) * 0.5, std::sin(azimuth) * 0.5, 0.5);
  const Eigen::Vector3d z = -from.normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  CalibratedCamera calibrated;
  calibrated.camera.name = name;
  calibrated.camera.cam_from_world = {rotation, -rotation * from};
  calibrated.camera.model.width_px = 1600;
  calibrated.camera.model.height_px = 1200;
  if (tsai) {
    calibrated.camera.model.lens =
        TsaiLens{10.6 * units::mm, 1200, 790, 600, 1.001, 3.45e-6, 3.45e-6};
  } else {
    calibrated.camera.model.lens = BrownLens{3100, 3098, 805, 596, -0.15, 0.03, 1e-3, -5e-4};
  }
  return calibrated;
}

struct Bench {
  std::vector<CalibratedCamera> cameras;
  Bench() {
    cameras = {camera_at(0, true, "cam0"), camera_at(50, false, "cam1"),
               camera_at(170, true, "cam2"), camera_at(260, false, "cam3")};
  }
  [[nodiscard]] std::vector<View> views(const Eigen::Vector3d& point, int count,
                                        const Eigen::Matrix2d& covariance) const {
    std::vector<View> result;
    for (int i = 0; i < count; ++i) {
      const Camera& camera = cameras[i].camera;
      result.push_back(
          {&cameras[i], project(camera.model, camera.cam_from_world * point)->px, covariance});
    }
    return result;
  }
};

}  // namespace drape::test

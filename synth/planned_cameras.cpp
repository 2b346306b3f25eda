// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>

#include "core/error.hpp"
#include "core/units.hpp"
#include "synth/synth.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::mm;

/// Pose of an upright camera, whose x axis is horizontal.
CamFromWorld looking(const Vector3d& from, const Vector3d& at) {
  const Vector3d z = (at - from).normalized();
  const bool straight_down = std::abs(z.z()) > 1 - 1e-9;
  const Vector3d x =
      straight_down ? Vector3d::UnitX() : Vector3d(z.cross(Vector3d::UnitZ()).normalized());
  CamFromWorld pose;
  pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  pose.translation_m = -pose.rotation * from;
  return pose;
}

Camera camera_of(const PlannedCamera& plan, const Rig& rig) {
  const RigCamera& known = rig.camera(plan.name);
  BrownLens lens;
  lens.fx_px = plan.focal_m / known.pixel_pitch_x_m;
  lens.fy_px = plan.focal_m / known.pixel_pitch_y_m;
  lens.cx_px = (known.width_px - 1) / 2.0;
  lens.cy_px = (known.height_px - 1) / 2.0;
  lens.k1 = plan.k1;
  lens.k2 = plan.k2;
  return {known.name,
          {lens, known.width_px, known.height_px},
          looking(plan.position_m, plan.look_at_m)};
}

std::vector<Camera> in_order_of(const Rig& rig, const std::vector<Camera>& cameras,
                                const std::string& file) {
  std::vector<Camera> ordered;
  for (const RigCamera& wanted : rig.cameras) {
    for (const Camera& camera : cameras) {
      if (camera.name == wanted.name) ordered.push_back(camera);
    }
    if (ordered.empty() || ordered.back().name != wanted.name) {
      throw bad_input("a camera of the rig is missing", {.file = file, .camera = wanted.name},
                      "give its place and focal length");
    }
  }
  return ordered;
}

}  // namespace

void fields(Fields& f, PlannedCamera& camera) {
  f(Field{"name", "name of the rig's camera"}.plain_name(), camera.name);
  f({"focal_mm", "focal length", mm, above_zero}, camera.focal_m);
  f({"position_mm", "position in the world", mm}, camera.position_m);
  f.otherwise({"look_at_mm", "point of the world at the centre of the picture", mm},
              camera.look_at_m);
  f.otherwise({"k1", "radial distortion"}, camera.k1);
  f.otherwise({"k2", "radial distortion"}, camera.k2);
  f.rule((camera.position_m - camera.look_at_m).norm() >= 1 * mm, "position_mm",
         "the camera stands where it looks at", "give two places");
}

void fields(Fields& f, CamerasPlan& plan) {
  f({"camera", "one table per camera of the rig"}, plan.cameras);
}

std::vector<Camera> read_planned_cameras(const std::filesystem::path& file, const Rig& rig) {
  std::vector<Camera> cameras;
  for (const PlannedCamera& plan : read_record<CamerasPlan>(file).cameras)
    cameras.push_back(camera_of(plan, rig));
  return in_order_of(rig, cameras, file.string());
}

std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig) {
  std::vector<Camera> cameras;
  for (const CalibratedCamera& camera : calibration.cameras) cameras.push_back(camera.camera);
  return in_order_of(rig, cameras, "calibration.json");
}

}  // namespace drape::synth

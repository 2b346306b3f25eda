// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>

#include "core/error.hpp"
#include "core/files/toml_file.hpp"
#include "core/units.hpp"
#include "synth/synth.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::mm;

Vector3d point_mm(const TomlTable& table, const std::string& key) {
  const std::vector<double> p = table.numbers(key, 3);
  return Vector3d(p[0], p[1], p[2]) * mm;
}

/// Upright camera: its x is level.
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

Camera read_camera(const TomlTable& table, const Rig& rig) {
  const RigCamera& known = rig.camera(table.text("name"));
  const Vector3d from = point_mm(table, "position_mm");
  const Vector3d at = table.has("look_at_mm") ? point_mm(table, "look_at_mm") : Vector3d::Zero();
  if ((from - at).norm() < 1 * mm)
    table.reject("position_mm", "the camera stands where it looks at", "give two places");
  const double focal_m = table.positive("focal_mm") * mm;
  BrownLens lens;
  lens.fx_px = focal_m / known.pixel_pitch_x_m;
  lens.fy_px = focal_m / known.pixel_pitch_y_m;
  lens.cx_px = (known.width_px - 1) / 2.0;
  lens.cy_px = (known.height_px - 1) / 2.0;
  lens.k1 = table.number_or("k1", 0);
  lens.k2 = table.number_or("k2", 0);
  return {known.name, {lens, known.width_px, known.height_px}, looking(from, at)};
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

std::vector<Camera> read_planned_cameras(const std::filesystem::path& file, const Rig& rig) {
  const TomlTable root = TomlTable::open(file, "cameras-plan");
  std::vector<Camera> cameras;
  for (const TomlTable& table : root.tables("camera")) cameras.push_back(read_camera(table, rig));
  root.finish();
  return in_order_of(rig, cameras, file.string());
}

std::vector<Camera> cameras_of(const Calibration& calibration, const Rig& rig) {
  std::vector<Camera> cameras;
  for (const CalibratedCamera& camera : calibration.cameras) cameras.push_back(camera.camera);
  return in_order_of(rig, cameras, "calibration.json");
}

}  // namespace drape::synth

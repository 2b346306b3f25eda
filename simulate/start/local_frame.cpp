// SPDX-License-Identifier: Apache-2.0
#include "simulate/start/local_frame.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/error.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGrain = 0x1p-33;       // m; also for unit vectors
constexpr double kSlopeGrain = 0x1p-42;  // for the direction in which cloth leaves a clamp

double rounded(double value) {
  return std::round(value / kGrain) * kGrain;
}

template <class Values>
Values rounded_all(const Values& values) {
  return values.unaryExpr([](double value) { return rounded(value); });
}

/// Transforms from the world to the local frame, with rounding.
struct ToLocal {
  Matrix3d turn;
  Vector3d origin;

  [[nodiscard]] Vector3d point(const Vector3d& p) const {
    return rounded_all(Vector3d(turn * (p - origin)));
  }
  /// Rounds a slope more finely, since its force scales with bending over a particle's weight.
  [[nodiscard]] Vector3d slope(const Vector3d& unit) const {
    return (turn * unit).unaryExpr([](double value) {
      return std::round(value / kSlopeGrain) * kSlopeGrain;
    });
  }
  [[nodiscard]] WorldFromObject pose(const WorldFromObject& world_from_object) const {
    return {rounded_all(Matrix3d(turn * world_from_object.rotation)),
            point(world_from_object.translation_m)};
  }
  void operator()(Sphere& body) const { body.centre_in_world = point(body.centre_in_world); }
  void operator()(Box& body) const { body.world_from_box = pose(body.world_from_box); }
  void operator()(Cylinder& body) const {
    body.world_from_cylinder = pose(body.world_from_cylinder);
  }
  void operator()(Plane& body) const {
    body.point_in_world = point(body.point_in_world);
    body.normal_in_world = rounded_all(Vector3d(turn * body.normal_in_world)).normalized();
  }
  void operator()(MeshObject& body) const { body.world_from_mesh = pose(body.world_from_mesh); }
};

/// Centre of the marks and direction of their weft, seen from above.
FlatPose pose_of_marks(const Sheet& measured) {
  FlatPose pose;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  const auto count = static_cast<double>(measured.marks.size());
  for (const SheetMark& mark : measured.marks) {
    pose.centre_in_world += mark.point_in_world / count;
    middle += mark.material_m / count;
  }
  double dot = 0, cross = 0;
  for (const SheetMark& mark : measured.marks) {
    const Vector3d p = mark.point_in_world - pose.centre_in_world;
    const Eigen::Vector2d q(mark.material_m.y() - middle.y(), middle.x() - mark.material_m.x());
    dot += q.x() * p.x() + q.y() * p.y();
    cross += q.x() * p.y() - q.y() * p.x();
  }
  pose.yaw_rad = std::atan2(cross, dot);
  return pose;
}

}  // namespace

Vector3d LocalScene::to_world(const Vector3d& local) const {
  return Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * local + origin_in_world;
}

Vector3d LocalScene::to_local(const Vector3d& world) const {
  const Eigen::AngleAxisd back(-yaw_rad, Vector3d::UnitZ());
  return ToLocal{back.toRotationMatrix(), origin_in_world}.point(world);
}

double LocalScene::gravity_offset_j(double mass_kg) const {
  const Vector3d gravity = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * scene.gravity_m_per_s2;
  return -mass_kg * gravity.dot(origin_in_world);
}

LocalScene local_scene(const Scene& world, const std::optional<Sheet>& measured, double top_z_m) {
  LocalScene local;
  if (world.start.mode == StartMode::measured) {
    local.placed.flat = pose_of_marks(need_measured(measured, world));
  } else {
    local.placed.flat = flat_start(world, measured, top_z_m, local.placed);
  }
  local.yaw_rad = local.placed.flat.yaw_rad;
  local.origin_in_world = local.placed.flat.centre_in_world;
  const ToLocal to_local{Eigen::AngleAxisd(-local.yaw_rad, Vector3d::UnitZ()).toRotationMatrix(),
                         local.origin_in_world};
  local.scene = world;
  for (Obstacle& obstacle : local.scene.obstacles) std::visit(to_local, obstacle);
  for (Pin& pin : local.scene.pins) {
    if (pin.point_in_world) pin.point_in_world = to_local.point(*pin.point_in_world);
  }
  for (Clamp& clamp : local.scene.clamps) {
    clamp.from_in_world = to_local.point(clamp.from_in_world);
    clamp.to_in_world = to_local.point(clamp.to_in_world);
    clamp.direction_in_world = to_local.slope(clamp.direction_in_world);
  }
  local.scene.table_z_m = rounded(world.table_z_m - local.origin_in_world.z());
  local.scene.gravity_m_per_s2 =
      world.gravity_m_per_s2.head<2>().isZero(0)
          ? world.gravity_m_per_s2
          : rounded_all(Vector3d(to_local.turn * world.gravity_m_per_s2));
  if (world.start.mode != StartMode::measured) {
    local.scene.start.mode = StartMode::flat;
    local.scene.start.centre_in_world = Vector3d::Zero();
    local.scene.start.yaw_rad = 0;
  }
  local.measured = measured;
  if (local.measured) {
    for (SheetMark& mark : local.measured->marks)
      mark.point_in_world = to_local.point(mark.point_in_world);
  }
  return local;
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/model.hpp"

#include <Eigen/Geometry>

#include "core/camera_derivatives.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

const BrownLens& lens_of(const JointCamera& camera) {
  return std::get<BrownLens>(camera.camera.model.lens);
}

/// Shear du/dv of the skew: u gains skew * (v - cy) / fy.
double shear(const JointCamera& camera) {
  return camera.skew_px / lens_of(camera).fy_px;
}

}  // namespace

Vector2d Board::shape(const Vector3d& point_in_target) const {
  return point_in_target.head<2>().cwiseQuotient(half_m).cwiseAbs2() - mean;
}

Eigen::Matrix<double, 3, board_parameters> Board::shapes(const Vector3d& point) const {
  Eigen::Matrix<double, 3, board_parameters> shapes;
  const Vector2d bow = shape(point);
  const Vector2d at = point.head<2>() / mm;
  shapes << 0, 0, at.x() / 2, at.y() / 2, at.x(),  //
      0, 0, -at.y() / 2, at.x() / 2, at.y(),       //
      bow.x(), bow.y(), 0, 0, 0;
  return shapes;
}

Eigen::Matrix<double, board_parameters, 1> Board::parameters() const {
  return {edge_rise_mm.x(), edge_rise_mm.y(), stretch.x(), stretch.y(), stretch.z()};
}

Vector3d Board::bent(const Vector3d& point, int place) const {
  const Vector3d moved_mm = shapes(point) * parameters();
  const auto at = static_cast<std::size_t>(place);
  return point + mm * (place >= 0 && at < shift_mm.size() ? moved_mm + shift_mm[at] : moved_mm);
}

std::optional<Vector2d> pixel_of(const JointCamera& camera, const Placement& placement,
                                 const Board& board, const Vector3d& point_in_target, int place) {
  const Vector3d in_world = placement.world_from_target * board.bent(point_in_target, place);
  const auto image = project(camera.camera.model, camera.camera.cam_from_world * in_world);
  if (!image) return std::nullopt;
  return Vector2d(image->px.x() + shear(camera) * (image->px.y() - lens_of(camera).cy_px),
                  image->px.y());
}

std::optional<Vector2d> pixel_of(const JointModel& model, const JointFrame& frame,
                                 const TargetPoint& point) {
  return pixel_of(model.cameras[frame.camera], model.placements[frame.placement], model.board,
                  point.point_in_target, point.place);
}

std::optional<TargetImage> image_of(const JointCamera& camera, const Placement& placement,
                                    const Board& board, const Vector3d& point_in_target,
                                    int place) {
  const CamFromWorld& cam_from_world = camera.camera.cam_from_world;
  const WorldFromTarget& world_from_target = placement.world_from_target;
  const Vector3d turned = world_from_target.rotation * board.bent(point_in_target, place);
  const Vector3d rotated = cam_from_world.rotation * (turned + world_from_target.translation_m);
  const Vector3d in_camera = rotated + cam_from_world.translation_m;
  const auto image = project(camera.camera.model, in_camera);
  if (!image) return std::nullopt;
  const BrownLens& lens = lens_of(camera);
  Matrix2d sheared = Matrix2d::Identity();
  sheared(0, 1) = shear(camera);
  TargetImage out;
  out.px = image->px + Vector2d(sheared(0, 1) * (image->px.y() - lens.cy_px), 0);
  const Eigen::Matrix<double, 2, 3> by_point = sheared * image->d_px_d_point;
  out.by_camera.leftCols<9>() = sheared * *d_px_d_lens(camera.camera.model, in_camera);
  // The skew multiplies the distorted y itself, which does not depend on fy or cy.
  out.by_camera(0, 1) = 0;
  out.by_camera(0, 3) = 0;
  out.by_camera.col(9) = Vector2d((image->px.y() - lens.cy_px) / lens.fy_px, 0);
  out.by_camera.middleCols<3>(lens_parameters) = -by_point * cross_matrix(rotated);
  out.by_camera.rightCols<3>() = by_point * mm;
  const Eigen::Matrix<double, 2, 3> by_world = by_point * cam_from_world.rotation;
  out.by_placement.leftCols<3>() = -by_world * cross_matrix(turned);
  out.by_placement.rightCols<3>() = by_world * mm;
  out.by_point = by_world * world_from_target.rotation * mm;
  out.by_board = out.by_point * board.shapes(point_in_target);
  return out;
}

std::optional<TargetImage> image_of(const JointModel& model, const JointFrame& frame,
                                    const TargetPoint& point) {
  return image_of(model.cameras[frame.camera], model.placements[frame.placement], model.board,
                  point.point_in_target, point.place);
}

JointCamera moved(const JointCamera& camera, const double* p) {
  JointCamera out = camera;
  out.camera.model.lens = BrownLens{p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8]};
  out.skew_px = p[9];
  CamFromWorld& pose = out.camera.cam_from_world;
  pose.rotation = rotation_about(Eigen::Map<const Vector3d>(p + 10)) * pose.rotation;
  pose.translation_m = Eigen::Map<const Vector3d>(p + 13) * mm;
  return out;
}

Placement moved(const Placement& placement, const double* p) {
  Placement out = placement;
  WorldFromTarget& pose = out.world_from_target;
  pose.rotation = rotation_about(Eigen::Map<const Vector3d>(p)) * pose.rotation;
  pose.translation_m = Eigen::Map<const Vector3d>(p + 3) * mm;
  return out;
}

}  // namespace drape::calib

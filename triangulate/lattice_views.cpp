// SPDX-License-Identifier: Apache-2.0
#include "triangulate/lattice_views.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/error.hpp"
#include "core/units.hpp"

namespace drape::triangulate {
namespace {

std::string sets_of(const Detections& detections) {
  std::string names;
  for (const FrameDetections& frame : detections.frames) {
    if (names.find("`" + frame.set + "`") == std::string::npos)
      names += (names.empty() ? "`" : ", `") + frame.set + "`";
  }
  return names;
}

const CalibratedCamera& camera_of(const FrameDetections& frame, const Calibration& calibration) {
  const CalibratedCamera& camera = calibration.camera(frame.camera);
  const CameraModel& model = camera.camera.model;
  if (frame.width_px != model.width_px || frame.height_px != model.height_px) {
    throw bad_input(
        fmt::format("the image is {} x {} px, the camera was calibrated with {} x {} px",
                    frame.width_px, frame.height_px, model.width_px, model.height_px),
        {.camera = frame.camera, .set = frame.set}, "calibrate with the same image size");
  }
  return camera;
}

/// Camera and floor common to all views of a frame.
struct FrameCamera {
  const CalibratedCamera* calibrated;
  const InJointCovariance* joint;
  double floor_px;
};

View view_of(const Detection& d, const FrameDetections& frame, const FrameCamera& camera) {
  if (!d.centre_px.allFinite() || !d.covariance_px2.allFinite() ||
      d.covariance_px2.llt().info() != Eigen::Success) {
    throw bad_input(
        fmt::format("mark ({}, {}) has a position or covariance that is not a finite number or "
                    "not positive",
                    d.mark.row, d.mark.col),
        {.camera = frame.camera, .set = frame.set}, "detect this frame again");
  }
  View view;
  view.camera = camera.calibrated;
  view.joint = camera.joint;
  view.px = d.centre_px;
  view.covariance_px2 =
      d.covariance_px2 + camera.floor_px * camera.floor_px * Eigen::Matrix2d::Identity();
  view.semi_axes_px = d.semi_axes_px;
  view.axis_angle_rad = d.axis_angle_rad;
  return view;
}

std::vector<MarkViews> empty_lattice(const MarkLattice& lattice) {
  std::vector<MarkViews> marks;
  for (int row = 0; row < lattice.rows; ++row) {
    for (int col = 0; col < lattice.cols; ++col) marks.push_back({{row, col}, {}, {}});
  }
  return marks;
}

void add_frame(const FrameDetections& frame, const MarkLattice& lattice, const FrameCamera& camera,
               std::vector<MarkViews>& marks) {
  const auto index = [&](MarkId mark) {
    return static_cast<std::size_t>(mark.row) * lattice.cols + mark.col;
  };
  const auto inside = [&](MarkId mark) {
    return mark.row >= 0 && mark.col >= 0 && mark.row < lattice.rows && mark.col < lattice.cols;
  };
  for (const Detection& d : frame.detections) {
    if (inside(d.mark)) marks[index(d.mark)].views.push_back(view_of(d, frame, camera));
  }
  for (const Rejection& r : frame.rejections) {
    if (!r.mark || !inside(*r.mark)) continue;
    marks[index(*r.mark)].refused.push_back(
        fmt::format("{} rejected it: {}", frame.camera, r.reason));
  }
}

}  // namespace

JointPlaces joint_places(const Calibration& calibration) {
  JointPlaces places;
  if (calibration.joint_covariance.size() == 0) return places;
  std::map<std::string, Eigen::Index> by_name;
  Eigen::Index next = 0;
  for (const std::string& name : calibration.joint_covariance_parameters)
    by_name.emplace(name, next++);
  for (const CalibratedCamera& camera : calibration.cameras) {
    InJointCovariance& own = places[camera.camera.name];
    own.covariance = &calibration.joint_covariance;
    if (calibration.target_covariance.size() > 0) own.target = &calibration.target_covariance;
    int found = 0;
    for (const std::string& parameter : parameter_names(camera.camera.model)) {
      const auto place = by_name.find(camera.camera.name + "/" + parameter);
      own.places.push_back(place == by_name.end() ? -1 : place->second);
      found += place != by_name.end();
    }
    if (found == 0) {
      throw bad_input("the joint covariance has no parameter of this camera",
                      {.field = "joint_covariance_parameters", .camera = camera.camera.name},
                      "calibrate the rig again");
    }
  }
  return places;
}

std::vector<MarkViews> collect_views(const Detections& detections, const Calibration& calibration,
                                     const JointPlaces& places, const std::string& set,
                                     double floor_px) {
  std::vector<MarkViews> marks = empty_lattice(detections.lattice);
  int frames = 0;
  for (const FrameDetections& frame : detections.frames) {
    if (frame.set != set) continue;
    const auto joint = places.find(frame.camera);
    const FrameCamera camera{&camera_of(frame, calibration),
                             joint == places.end() ? nullptr : &joint->second, floor_px};
    add_frame(frame, detections.lattice, camera, marks);
    ++frames;
  }
  if (frames < 2) {
    throw bad_input(fmt::format("{} frame(s) of this set; a point in space needs two", frames),
                    {.set = set}, fmt::format("the detections hold {}", sets_of(detections)));
  }
  return marks;
}

std::optional<std::vector<Looker>> lookers_at(MarkId mark, const std::vector<SheetMark>& placed,
                                              const std::vector<const CalibratedCamera*>& cameras) {
  constexpr int kNearSteps = 2;
  constexpr double kLeastAcross = 0.4;  // least spread of neighbours across their line, in steps
  std::vector<const SheetMark*> near;
  for (const SheetMark& other : placed) {
    const MarkId step = other.mark - mark;
    if (std::max(std::abs(step.row), std::abs(step.col)) <= kNearSteps) near.push_back(&other);
  }
  const auto count = static_cast<Eigen::Index>(near.size());
  if (count < 4) return std::nullopt;
  // Position, step along the warp, step along the weft.
  Eigen::MatrixX3d steps(count, 3), places(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const MarkId step = near[static_cast<std::size_t>(i)]->mark - mark;
    steps.row(i) << 1, step.row, step.col;
    places.row(i) = near[static_cast<std::size_t>(i)]->point_in_world.transpose();
  }
  const Eigen::Matrix3d normal = steps.transpose() * steps;
  const Eigen::Matrix2d spread = (normal.bottomRightCorner<2, 2>() -
                                  normal.block<2, 1>(1, 0) * normal.block<1, 2>(0, 1) / count) /
                                 count;
  if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvalues()(0) <
      kLeastAcross * kLeastAcross)
    return std::nullopt;
  const Eigen::Matrix3d plane = normal.ldlt().solve(steps.transpose() * places).transpose();
  const Eigen::Vector3d at = plane.col(0), face = plane.col(1).cross(plane.col(2)).normalized();
  std::vector<Looker> lookers;
  for (const CalibratedCamera* calibrated : cameras) {
    const Camera& camera = calibrated->camera;
    const auto seen = project(camera.model, camera.cam_from_world * at);
    if (!seen || seen->px.minCoeff() < 0 || seen->px.x() > camera.model.width_px - 1 ||
        seen->px.y() > camera.model.height_px - 1)
      continue;
    const double angle_deg =
        std::acos(std::clamp(face.dot((centre_in_world(camera) - at).normalized()), -1.0, 1.0)) /
        units::deg;
    if (angle_deg < 90) lookers.push_back({camera.name, angle_deg});
  }
  return lookers;
}

std::string too_few_views(const MarkViews& mark,
                          const std::optional<std::vector<Looker>>& lookers) {
  const std::string* own = mark.views.empty() ? nullptr : &mark.views.front().camera->camera.name;
  std::vector<std::string> others;
  for (const Looker& looker : lookers.value_or(std::vector<Looker>{}))
    if (own == nullptr || looker.camera != *own)
      others.push_back(fmt::format("{} at {:.0f} degrees", looker.camera, looker.angle_deg));
  const std::string from = fmt::format("{}", fmt::join(others, ", "));
  std::string reason = "seen by no camera";
  if (own != nullptr)
    reason = fmt::format("seen by one camera ({}){}", *own,
                         others.empty() ? "" : "; not measured by " + from);
  else if (!others.empty())
    reason = fmt::format(
        "seen by {}, measured by none: {}",
        others.size() == 1 ? "one camera" : fmt::format("{} cameras", others.size()), from);
  else if (lookers)
    reason += ": none looks at its printed face";
  for (const std::string& refused : mark.refused) reason += "; " + refused;
  return reason;
}

}  // namespace drape::triangulate

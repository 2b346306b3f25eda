// SPDX-License-Identifier: Apache-2.0
#include "triangulate/lattice_views.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>

#include "core/error.hpp"

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

/// Camera and floor that all views of a frame have in common.
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

std::string too_few_views(const MarkViews& mark) {
  std::string reason = mark.views.empty() ? "seen by no camera"
                                          : fmt::format("seen by one camera ({})",
                                                        mark.views.front().camera->camera.name);
  for (const std::string& refused : mark.refused) reason += "; " + refused;
  return reason;
}

}  // namespace drape::triangulate

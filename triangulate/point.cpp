// SPDX-License-Identifier: Apache-2.0
#include "triangulate/point.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/camera_model.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::triangulate {

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector2d, Eigen::Vector3d, Eigen::VectorXd;

namespace {

/// Covariance of the projected pixels for separately calibrated cameras: block diagonal.
MatrixXd noise_of_separate_cameras(const std::vector<View>& views, const Vector3d& in_world) {
  MatrixXd pixels = MatrixXd::Zero(2 * views.size(), 2 * views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const CalibratedCamera& calibrated = *views[i].camera;
    if (calibrated.covariance.size() == 0) continue;
    const auto by_parameters = d_px_d_parameters(calibrated.camera, in_world);
    if (!by_parameters || by_parameters->cols() != calibrated.covariance.cols()) continue;
    const auto at = 2 * static_cast<Eigen::Index>(i);
    pixels.block<2, 2>(at, at) =
        *by_parameters * calibrated.covariance * by_parameters->transpose();
  }
  return pixels;
}

/// Derivative of all pixels by the parameters of jointly calibrated cameras, whose errors are
/// correlated.
MatrixXd by_joint_cameras(const std::vector<View>& views, const Vector3d& in_world) {
  MatrixXd by_all = MatrixXd::Zero(2 * views.size(), views.front().joint->covariance->cols());
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto by_parameters = d_px_d_parameters(views[i].camera->camera, in_world);
    if (!by_parameters) continue;
    for (Eigen::Index k = 0; k < by_parameters->cols(); ++k) {
      const Eigen::Index place = views[i].joint->places.at(k);
      if (place >= 0)
        by_all.block<2, 1>(2 * static_cast<Eigen::Index>(i), place) = by_parameters->col(k);
    }
  }
  return by_all;
}

std::string why_not(PointStatus status) {
  switch (status) {
    case PointStatus::not_observable:
      return "not observable: the rays of its views are nearly parallel";
    case PointStatus::behind_a_camera:
      return "views disagree: the rays meet behind a camera or outside its lens model";
    default:
      return "not converged";
  }
}

std::string names_of(const std::vector<View>& views) {
  std::string names;
  for (const View& view : views) names += (names.empty() ? "" : ", ") + view.camera->camera.name;
  return names;
}

std::vector<View> without(const std::vector<View>& views, std::size_t index) {
  std::vector<View> rest = views;
  rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(index));
  return rest;
}

/// Best of the solutions with one view left out.
struct LeftOut {
  Point point;
  std::size_t index = 0;
  bool unique = true;  ///< true if no other single omission makes the views agree
};

std::optional<LeftOut> leave_one_out(const std::vector<View>& views,
                                     const AgreementLimits& limits) {
  std::optional<LeftOut> best;
  int agreeing = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    Point point = solve_point(without(views, i), limits.min_angle_rad);
    if (point.status != PointStatus::good) continue;
    agreeing += point.disagreement_sigmas() <= limits.max_sigmas;
    if (!best || point.disagreement_sigmas() < best->point.disagreement_sigmas())
      best = LeftOut{std::move(point), i, true};
  }
  if (!best || best->point.disagreement_sigmas() > limits.max_sigmas) return std::nullopt;
  best->unique = agreeing == 1;
  return best;
}

/// Widens the covariance to the views' scatter (Birge 1932), as an error of the dot's shape.
void widen(Point& point) {
  const double surplus = std::max(0.0, point.chi2 / point.degrees_of_freedom - 1);
  point.shape_covariance_m2 +=
      surplus * (point.detection_covariance_m2 + point.shape_covariance_m2);
}

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

/// A view with the camera of `common`, its covariance enlarged by the floor.
View view_of(const Detection& d, const FrameDetections& frame, const View& common,
             double floor_px) {
  if (!d.centre_px.allFinite() || !d.covariance_px2.allFinite() ||
      d.covariance_px2.llt().info() != Eigen::Success) {
    throw bad_input(
        fmt::format("mark ({}, {}) has a position or covariance that is not a finite number or "
                    "not positive",
                    d.mark.row, d.mark.col),
        {.camera = frame.camera, .set = frame.set}, "detect this frame again");
  }
  View view = common;
  view.px = d.centre_px;
  view.covariance_px2 = d.covariance_px2 + floor_px * floor_px * Eigen::Matrix2d::Identity();
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

void add_frame(const FrameDetections& frame, const MarkLattice& lattice, const View& common,
               double floor_px, std::vector<MarkViews>& marks) {
  const auto index = [&](MarkId mark) {
    return static_cast<std::size_t>(mark.row) * lattice.cols + mark.col;
  };
  const auto inside = [&](MarkId mark) {
    return mark.row >= 0 && mark.col >= 0 && mark.row < lattice.rows && mark.col < lattice.cols;
  };
  for (const Detection& d : frame.detections) {
    if (inside(d.mark)) marks[index(d.mark)].views.push_back(view_of(d, frame, common, floor_px));
  }
  for (const Rejection& r : frame.rejections) {
    if (!r.mark || !inside(*r.mark)) continue;
    marks[index(*r.mark)].refused.push_back(
        fmt::format("{} rejected it: {}", frame.camera, r.reason));
  }
}

}  // namespace

Eigen::Matrix2d View::shape_px2() const {
  const Eigen::Vector2d major(std::cos(axis_angle_rad), std::sin(axis_angle_rad));
  const Eigen::Vector2d minor(-major.y(), major.x());
  const Eigen::Vector2d squared = semi_axes_px.cwiseAbs2();
  return squared[0] * major * major.transpose() + squared[1] * minor * minor.transpose();
}

Matrix3d Point::covariance_m2() const {
  return detection_covariance_m2 + shape_covariance_m2 + calibration_covariance_m2;
}

double Point::rms_px() const {
  double sum = 0;
  for (const Vector2d& residual : residuals_px) sum += residual.squaredNorm();
  return residuals_px.empty() ? 0 : std::sqrt(sum / static_cast<double>(residuals_px.size()));
}

double Point::disagreement_sigmas() const {
  if (degrees_of_freedom < 1) return 0;
  if (degrees_of_freedom == 1) return std::sqrt(chi2);
  // Wilson and Hilferty 1931: the cube root of a chi-square variable is nearly normal.
  const double spread = 2.0 / (9.0 * degrees_of_freedom);
  return (std::cbrt(chi2 / degrees_of_freedom) - (1 - spread)) / std::sqrt(spread);
}

std::optional<Vector3d> midpoint(const std::vector<View>& views, double min_angle_rad) {
  std::vector<Ray> rays;
  for (const View& view : views) {
    const auto ray = ray_of(view.camera->camera, view.px);
    if (!ray) return std::nullopt;
    rays.push_back(*ray);
  }
  return nearest_to_rays(rays, min_angle_rad);
}

Point solve_point(const std::vector<View>& views, double min_angle_rad) {
  Point point;
  if (views.size() < 2) return point;
  std::vector<PixelView> pixels;
  MatrixXd shared(2 * views.size(), views.front().shape_px.cols());
  for (const View& view : views) {
    shared.middleRows<2>(2 * static_cast<Eigen::Index>(pixels.size())) = view.shape_px;
    pixels.push_back({&view.camera->camera, view.px, view.covariance_px2});
  }
  const PointFit fit = fit_point(pixels, min_angle_rad, shared);
  point.status = fit.status;
  point.in_world = fit.in_world;
  if (fit.status != PointStatus::good) return point;
  const MatrixXd by_shared = fit.by_pixels * shared;
  MatrixXd calibration;
  if (const InJointCovariance* joint = views.front().joint) {
    const MatrixXd by_cameras = by_joint_cameras(views, point.in_world);
    calibration = by_cameras * *joint->covariance * by_cameras.transpose();
    const MatrixXd moves = fit.by_pixels * by_cameras;
    if (joint->target != nullptr)
      point.target_covariance_m2 = moves * *joint->target * moves.transpose();
  } else {
    calibration = noise_of_separate_cameras(views, point.in_world);
  }
  point.shape_covariance_m2 = by_shared * by_shared.transpose();
  point.calibration_covariance_m2 = fit.by_pixels * calibration * fit.by_pixels.transpose();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    const auto by_view = fit.by_pixels.middleCols<2>(at);
    point.detection_covariance_m2 += by_view * views[i].covariance_px2 * by_view.transpose();
    point.residuals_px.emplace_back(fit.residuals_px.segment<2>(at));
  }
  point.chi2 = fit.residuals_px.dot(
      solve_positive(fit.covariance_px2 + calibration, VectorXd(fit.residuals_px)));
  point.degrees_of_freedom = 2 * static_cast<int>(views.size()) - 3;
  return point;
}

Agreed solve_with_agreement(const std::vector<View>& views, const AgreementLimits& limits) {
  Agreed result;
  Point all = solve_point(views, limits.min_angle_rad);
  result.disagreement_sigmas = all.disagreement_sigmas();
  const bool within = result.disagreement_sigmas <= limits.max_sigmas;
  const bool bent = !within && views.size() >= 3 && all.rms_px() <= limits.shape_px;
  if (all.status == PointStatus::good && (within || bent)) {
    if (bent) widen(all);
    result.point = std::move(all);
    result.used.resize(views.size());
    std::iota(result.used.begin(), result.used.end(), std::size_t{0});
    return result;
  }
  if (views.size() >= 3) {
    if (auto rest = leave_one_out(views, limits); rest && rest->unique) {
      result.point = std::move(rest->point);
      result.dropped = rest->index;
      for (std::size_t i = 0; i < views.size(); ++i)
        if (i != rest->index) result.used.push_back(i);
      return result;
    }
  }
  result.gap_reason =
      all.status == PointStatus::good
          ? fmt::format(
                "views disagree: {} miss each other by {:.1f} sigma ({:.2f} px), limit {:g}",
                names_of(views), result.disagreement_sigmas, all.rms_px(), limits.max_sigmas)
          : why_not(all.status);
  return result;
}

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
    View common;
    common.camera = &camera_of(frame, calibration);
    if (joint != places.end()) common.joint = &joint->second;
    add_frame(frame, detections.lattice, common, floor_px, marks);
    ++frames;
  }
  if (frames < 2) {
    throw bad_input(fmt::format("{} frame(s) of this set; a point in space needs two", frames),
                    {.set = set}, fmt::format("the detections hold {}", sets_of(detections)));
  }
  return marks;
}

}  // namespace drape::triangulate

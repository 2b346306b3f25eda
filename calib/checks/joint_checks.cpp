// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/joint_checks.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;
using units::deg;

constexpr double kLeastTiltDeg = 10;   ///< below this, f and the distance are inseparable
constexpr double kLeastSpreadDeg = 5;  ///< between the normals of free views
constexpr double kSameViewPx = 0.5;

double angle_deg(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(std::abs(a.dot(b)), 1.0)) / deg;
}

/// Normals of the target in the camera frame, one per view.
std::vector<Vector3d> normals_of(const JointModel& model, std::size_t camera) {
  std::vector<Vector3d> normals;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    normals.emplace_back(model.cameras[camera].camera.cam_from_world.rotation *
                         model.placements[frame.placement].world_from_target.rotation.col(2));
  }
  return normals;
}

Vector4d box_of(const JointModel& model, std::size_t camera) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Vector4d box(kFar, kFar, -kFar, -kFar);
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    for (const TargetPoint& point : frame.points) {
      box.head<2>() = box.head<2>().cwiseMin(point.measured_px);
      box.tail<2>() = box.tail<2>().cwiseMax(point.measured_px);
    }
  }
  return box;
}

void check_directions(const JointModel& model, std::size_t camera) {
  const std::vector<Vector3d> normals = normals_of(model, camera);
  const Where where{.camera = model.cameras[camera].camera.name};
  double spread = 0;
  for (const Vector3d& a : normals) {
    for (const Vector3d& b : normals) spread = std::max(spread, angle_deg(a, b));
  }
  const double tilt = largest_tilt_deg(model, camera);
  if (tilt < kLeastTiltDeg) {
    throw bad_input(fmt::format("too little tilt: the target is at most {:.1f} deg off parallel to "
                                "the image, so focal length and distance cannot be separated",
                                tilt),
                    where, "add views with the target tilted by 30 degrees, to both sides");
  }
  int heights = 0;
  for (const JointFrame& frame : model.frames)
    heights += frame.camera == camera && model.placements[frame.placement].known ? 1 : 0;
  if (heights >= 2) return;
  if (normals.size() < 2) {
    throw bad_input("one view of a flat target: the image centre is not observable", where,
                    "add two or more views with other tilts, or a z stage");
  }
  if (spread < kLeastSpreadDeg) {
    throw bad_input(fmt::format("parallel planes: all views have the same tilt within {:.1f} deg, "
                                "which repeats one view's information",
                                spread),
                    where, "add views tilted by 30 degrees about another axis");
  }
}

void check_place_in_image(const JointModel& model, std::size_t camera) {
  const CameraModel& image = model.cameras[camera].camera.model;
  const Vector4d box = box_of(model, camera);
  const Vector2d middle(image.width_px / 2.0, image.height_px / 2.0);
  if (!(box[0] <= box[2])) return;  // no points at all: start_joint names the camera
  const bool one_side_u = box[2] < middle.x() || box[0] > middle.x();
  const bool one_side_v = box[3] < middle.y() || box[1] > middle.y();
  if (!one_side_u || !one_side_v) return;
  throw bad_input(fmt::format("all views lie in one corner of the image: u {:.0f} to {:.0f}, v "
                              "{:.0f} to {:.0f} of {} x {} px",
                              box[0], box[2], box[1], box[3], image.width_px, image.height_px),
                  {.camera = model.cameras[camera].camera.name},
                  "move the target through the middle and the other corners of the image");
}

/// Mean distance (px) between the common dots of two frames.
double mean_shift_px(const JointFrame& a, const JointFrame& b) {
  double sum = 0;
  int common = 0;
  for (const TargetPoint& p : a.points) {
    const auto same = std::find_if(b.points.begin(), b.points.end(),
                                   [&](const TargetPoint& q) { return q.dot == p.dot; });
    if (same == b.points.end()) continue;
    sum += (p.measured_px - same->measured_px).norm();
    ++common;
  }
  return common > 0 ? sum / common : std::numeric_limits<double>::infinity();
}

void warn_of_duplicates(const JointModel& model, std::vector<std::string>& warnings) {
  for (std::size_t a = 0; a < model.frames.size(); ++a) {
    for (std::size_t b = a + 1; b < model.frames.size(); ++b) {
      const JointFrame &one = model.frames[a], &two = model.frames[b];
      if (one.camera != two.camera || mean_shift_px(one, two) >= kSameViewPx) continue;
      warnings.push_back(fmt::format(
          "duplicate views: {} shows the target in the same place in sets {} and {}; the second "
          "adds no new direction, move the target between sets",
          model.cameras[one.camera].camera.name, model.placements[one.placement].set,
          model.placements[two.placement].set));
    }
  }
}

}  // namespace

double largest_tilt_deg(const JointModel& model, std::size_t camera) {
  double tilt = 0;
  for (const Vector3d& normal : normals_of(model, camera))
    tilt = std::max(tilt, angle_deg(normal, Vector3d::UnitZ()));
  return tilt;
}

double covered_percent(const JointModel& model, std::size_t camera) {
  const CameraModel& image = model.cameras[camera].camera.model;
  const Vector4d box = box_of(model, camera);
  return 100 * (box[2] - box[0]) * (box[3] - box[1]) / (image.width_px * image.height_px);
}

void check_places(const JointModel& views) {
  for (std::size_t camera = 0; camera < views.cameras.size(); ++camera)
    check_place_in_image(views, camera);
}

void check_views(const JointModel& started, bool lens_known, std::vector<std::string>& warnings) {
  for (std::size_t camera = 0; !lens_known && camera < started.cameras.size(); ++camera) {
    check_directions(started, camera);
  }
  warn_of_duplicates(started, warnings);
}

std::vector<ViewReport> view_reports(const JointModel& model) {
  std::vector<ViewReport> views;
  std::vector<double> all;
  for (const JointFrame& frame : model.frames) {
    if (frame.points.empty()) continue;
    double sum = 0;
    for (const TargetPoint& point : frame.points)
      sum += std::pow(distance_px(model, frame, point), 2);
    const auto points = static_cast<int>(frame.points.size());
    views.push_back({model.placements[frame.placement].set, model.cameras[frame.camera].camera.name,
                     points, std::sqrt(sum / points), false});
    all.push_back(views.back().rms_px);
  }
  if (all.empty()) return views;
  const double middle = median(std::move(all));
  for (ViewReport& view : views) view.suspicious = view.rms_px > 2 * middle;
  return views;
}

std::string judge_squares(const JointModel& model, const Calibration& calibration,
                          JointReport& report) {
  constexpr double kNamed = 1e-3, kSigmas = 3;
  const double stretch = report.print[2];
  if (std::abs(stretch) > kNamed && std::abs(stretch) > kSigmas * report.print_sd[2])
    report.warnings.push_back(fmt::format(
        "the print is {:.2f} +- {:.2f} % longer along its {} than along its {} against the "
        "drawing; the calibration takes that into account",
        100 * std::abs(stretch), 100 * report.print_sd[2], stretch > 0 ? "rows (x)" : "columns (y)",
        stretch > 0 ? "columns (y)" : "rows (x)"));
  std::string contradiction;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const Eigen::MatrixXd& covariance = calibration.cameras[c].covariance;
    if (covariance.size() == 0) continue;
    const auto& lens = std::get<BrownLens>(model.cameras[c].camera.model.lens);
    const double ratio = lens.fy_px / lens.fx_px;
    const Vector2d by(-ratio / lens.fx_px, 1 / lens.fx_px);
    const double sd = std::sqrt(by.dot(covariance.topLeftCorner<2, 2>() * by));
    if (std::abs(ratio - 1) < kNamed || std::abs(ratio - 1) < kSigmas * sd) continue;
    const double promised = model.cameras[c].square_sd;
    const std::string found = fmt::format(
        "{}: fy/fx is {:.4f} +- {:.4f}: the target's print is stretched, or the pixels are not "
        "square",
        model.cameras[c].camera.name, ratio, sd);
    if (promised > 0 && std::abs(ratio - 1) > kSigmas * std::hypot(sd, promised)) {
      if (contradiction.empty())
        contradiction = fmt::format(
            "{}, which rig.toml promises (square_pixels_percent = {:g}): calibrate with --board "
            "free, or measure the print along x and y and add [[known_length]]",
            found, 100 * promised);
    } else {
      report.warnings.push_back(
          found +
          "; to tell, measure the print along x and y, or turn it by 90 degrees in half of "
          "the views");
    }
  }
  return contradiction;
}

std::string joint_status(const JointReport& report, bool converged, bool has_covariance,
                         std::size_t gross, std::size_t measured, const CalibOptions& options) {
  if (!converged) return fmt::format("not converged after {} iterations", report.iterations);
  if (100 * static_cast<double>(gross) >
      options.max_outliers_percent * static_cast<double>(measured)) {
    return fmt::format(
        "{} of {} points rejected that lie more than {:g} mm off, more than {:g} %: check labels, "
        "heights and whether a camera moved",
        gross, measured, options.max_rms_mm, options.max_outliers_percent);
  }
  for (const JointCameraReport& camera : report.cameras) {
    if (camera.object_rms_mm > options.max_rms_mm) {
      return fmt::format("{}: RMS {:.3f} mm at the target ({:.3f} px), above the limit of {:g} mm",
                         camera.camera, camera.object_rms_mm, camera.rms_px, options.max_rms_mm);
    }
  }
  if (!has_covariance)
    return "ill-conditioned: the parameters cannot be separated; add views with other tilts";
  for (const JointCameraReport& camera : report.cameras) {
    if (100 * camera.centre_sd_px > options.max_centre_sd_percent * camera.focal_px) {
      return fmt::format(
          "{}: ill-conditioned: image centre known to {:.1f} px only (limit {:g} % of the focal "
          "length); add views with other tilts",
          camera.camera, camera.centre_sd_px, options.max_centre_sd_percent);
    }
    if (100 * camera.focal_sd_px > options.max_focal_sd_percent * camera.focal_px) {
      return fmt::format(
          "{}: ill-conditioned: focal length known to {:.1f} % only (limit {:g} %); "
          "add views with more tilt",
          camera.camera, 100 * camera.focal_sd_px / camera.focal_px, options.max_focal_sd_percent);
    }
  }
  return "good";
}

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/next_view.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/joint.hpp"
#include "calib/joint/covariance.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

struct Candidate {
  std::string words;
  Placement placement;
};

std::vector<Candidate> candidates(const JointModel& model) {
  const WorldBox box = drape_volume(model);
  std::vector<Candidate> list;
  for (const double tilt_deg : {-30.0, 30.0}) {
    for (const auto& [name, axis] : {std::pair("x", Vector3d(Vector3d::UnitX())),
                                     std::pair("y", Vector3d(Vector3d::UnitY()))}) {
      for (const auto& [place, shift] :
           {std::pair("in the middle", Vector3d(0, 0, 0)),
            std::pair("towards +x", Vector3d(1, 0, 0)), std::pair("towards -x", Vector3d(-1, 0, 0)),
            std::pair("towards +y", Vector3d(0, 1, 0)),
            std::pair("towards -y", Vector3d(0, -1, 0))}) {
        Candidate c;
        c.words = fmt::format("tilted by {:+.0f} deg about its {} axis, {}", tilt_deg, name, place);
        c.placement.world_from_target.rotation = rotation_about(tilt_deg * units::deg * axis);
        c.placement.world_from_target.translation_m =
            0.5 * (box.low + box.high) + 0.5 * shift.cwiseProduct(box.high);
        list.push_back(c);
      }
    }
  }
  return list;
}

/// The whole target as the cameras would see it, with the mean noise of their views.
std::vector<JointFrame> views_of(const JointModel& model, const Placement& placement) {
  std::vector<JointFrame> views;
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    const CameraModel& image = model.cameras[c].camera.model;
    const JointFrame* like = nullptr;
    for (const JointFrame& frame : model.frames) {
      if (frame.camera == c && (like == nullptr || frame.points.size() > like->points.size()))
        like = &frame;
    }
    if (like == nullptr) continue;
    JointFrame view{c, 0, like->points};
    const bool inside =
        std::all_of(view.points.begin(), view.points.end(), [&](const TargetPoint& p) {
          const auto px = pixel_of(model.cameras[c], placement, model.bow, p.point_in_target);
          return px && px->minCoeff() >= 0 && px->x() < image.width_px && px->y() < image.height_px;
        });
    if (inside) views.push_back(std::move(view));
  }
  return views;
}

/// Standard deviation over the drape volume (mm) by an information; for one camera, of its centre.
double figure_mm(const JointModel& model, const JointFit& fit, const MatrixXd& information,
                 const std::vector<Vector3d>& grid) {
  Calibration calibration;
  const JointCovariance covariance =
      joint_covariance(model, fit, inverse_of_information(information));
  calibration.joint_covariance = covariance.cameras;
  for (const JointCamera& camera : model.cameras) {
    calibration.cameras.emplace_back();
    calibration.cameras.back().camera = camera.camera;
  }
  if (const auto sd = volume_sd_mm(calibration, grid)) return *sd;
  calibration.cameras.front().covariance = covariance.cameras.topLeftCorner(15, 15);
  return std::sqrt(centre_covariance_mm2(calibration.cameras.front()).trace());
}

}  // namespace

std::string next_view(const JointModel& model, const JointFit& fit, double now_mm) {
  const std::vector<Vector3d> grid = grid_of(drape_volume(model), 2);
  const MatrixXd information = information_of(model, fit);
  const double by_points_mm = figure_mm(model, fit, information, grid);
  double best_mm = by_points_mm;
  std::string best;
  for (const Candidate& candidate : candidates(model)) {
    const std::vector<JointFrame> views = views_of(model, candidate.placement);
    if (views.empty()) continue;
    const MatrixXd more = information_of_view(model, fit, candidate.placement, views);
    MatrixXd sum = information;
    sum.topLeftCorner(more.rows(), more.cols()) += more;
    const double then_mm = figure_mm(model, fit, sum, grid);
    if (then_mm >= best_mm) continue;
    best_mm = then_mm;
    best = fmt::format("target {} (seen whole by {} of {} cameras)", candidate.words, views.size(),
                       model.cameras.size());
  }
  if (best.empty()) return "no further pose of the target would help within the cameras' view";
  return fmt::format("{}: calibration's part of a measured point {:.4f} -> {:.4f} mm", best, now_mm,
                     now_mm * best_mm / by_points_mm);
}

}  // namespace drape::calib

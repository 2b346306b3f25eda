// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/wide_lens.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/checks/one_more.hpp"
#include "calib/joint/alone.hpp"
#include "calib/joint/view_scatter.hpp"
#include "core/error.hpp"
#include "core/statistics/sample.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// A bias of fewer stated standard deviations is covered by the stated interval.
constexpr double kHarmSigmas = 3;
constexpr double kNowhere = std::numeric_limits<double>::infinity();

constexpr const char* kRemedy = "use a lens of less view, or pictures as the camera took them";

/// Radius covered by a camera's points: largest distance from the axis at depth 1.
double largest_radius(const JointModel& model, std::size_t camera) {
  double largest = 0;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != camera) continue;
    for (const TargetPoint& point : frame.points) {
      const Vector3d at =
          model.cameras[camera].camera.cam_from_world *
          (model.placements[frame.placement].world_from_target * point.point_in_target);
      largest = std::max(largest, at.head<2>().norm() / at.z());
    }
  }
  return largest;
}

double miss_of(const JointCamera& camera, const Placement& placement, const Board& board,
               const TargetPoint& point) {
  const auto px = pixel_of(camera, placement, board, point.point_in_target, point.place);
  return px ? (whitener(point.covariance_px2) * (*px - point.px())).norm() : kNowhere;
}

/// Median residual of a camera's points in the fit of all cameras, in standard deviations.
double miss_together(const JointModel& model, std::size_t index) {
  std::vector<double> misses;
  for (const JointFrame& frame : model.frames) {
    if (frame.camera != index) continue;
    for (const TargetPoint& point : frame.points)
      misses.push_back(
          miss_of(model.cameras[index], model.placements[frame.placement], model.board, point));
  }
  return misses.empty() ? 0 : median(misses);
}

/// Same, in a fit of the camera's own views.
double typical_miss(JointModel model, std::size_t index) {
  SeenTargets alone;
  std::vector<std::string> dropped;
  try {
    alone = solve_alone(model, index, false, dropped, LensTerms::k1_k2_p1_p2_k3);
  } catch (const Error&) {
    return kNowhere;
  }
  JointCamera camera = model.cameras[index];
  camera.camera.cam_from_world = {};
  std::vector<double> misses;
  for (std::size_t f = 0; f < model.frames.size(); ++f) {
    if (model.frames[f].camera != index) continue;
    for (const TargetPoint& point : model.frames[f].points) {
      misses.push_back(kNowhere);
      if (!alone[f]) continue;
      const CamFromTarget& pose = alone[f]->cam_from_target;
      misses.back() =
          miss_of(camera, {"", {pose.rotation, pose.translation_m}, true}, model.board, point);
    }
  }
  return misses.empty() ? kNowhere : median(misses);
}

/// Converts the camera's points to those of a distortion-free lens, assuming an equidistant fisheye
/// of this focal length (r = f angle). Frames with fewer than four points are dropped.
JointModel without_fisheye(const JointModel& model, std::size_t index, double focal_px) {
  JointModel straight = model;
  const CameraModel& image = model.cameras[index].camera.model;
  const Vector2d middle((image.width_px - 1) / 2.0, (image.height_px - 1) / 2.0);
  std::erase_if(straight.frames, [&](const JointFrame& frame) { return frame.camera != index; });
  for (JointFrame& frame : straight.frames) {
    std::vector<TargetPoint> seen;
    for (TargetPoint point : frame.points) {
      const Vector2d off = point.px() - middle;
      const double angle = off.norm() / focal_px;
      if (angle > 1.45 || angle < 1e-9) continue;  // 83 degrees; the tangent diverges at 90
      const Vector2d along = off.normalized();
      const double tangent = std::tan(angle);
      const Eigen::Matrix2d radial = along * along.transpose();
      const Eigen::Matrix2d grows = (1 + tangent * tangent) * radial +
                                    tangent / angle * (Eigen::Matrix2d::Identity() - radial);
      point.measured_px = middle + focal_px * tangent * along;
      point.eccentricity_px.setZero();
      point.covariance_px2 = (grows * point.covariance_px2 * grows.transpose()).eval();
      seen.push_back(point);
    }
    frame.points = std::move(seen);
  }
  std::erase_if(straight.frames, [](const JointFrame& frame) { return frame.points.size() < 4; });
  return straight;
}

std::string fisheye(const JointModel& model, std::size_t index) {
  // One camera's parallel views may not determine a lens that all cameras together do.
  double brown = miss_together(model, index);
  if (brown > 2 * kRayleighMedian) brown = std::min(brown, typical_miss(model, index));
  // If cameras contradict each other, the board seen by all of them is unreliable too.
  if (JointModel drawn = model; brown > 2 * kRayleighMedian) {
    drawn.board.edge_rise_mm.setZero();
    brown = std::min(brown, typical_miss(std::move(drawn), index));
  }
  if (!(brown > 2 * kRayleighMedian)) return "";
  const CameraModel& image = model.cameras[index].camera.model;
  const double half_px = std::hypot(image.width_px, image.height_px) / 2;
  double best = kNowhere, best_deg = 0;
  for (const double half_deg : {40.0, 52.0, 64.0, 76.0, 90.0, 105.0}) {
    const double miss =
        typical_miss(without_fisheye(model, index, half_px / (half_deg * units::deg)), index);
    if (miss >= best) continue;
    best = miss;
    best_deg = half_deg;
  }
  if (!(best * std::sqrt(2.0) < brown)) return "";
  return fmt::format(
      "{}: its lens is wider than the lens model: a fisheye lens of about {:.0f} deg across fits "
      "its "
      "views with misses of {:.1f} standard deviations, Brown's lens with {:.1f}; {}",
      model.cameras[index].camera.name, 2 * best_deg, best, brown, kRemedy);
}

std::string missing_term(const JointModel& model, const JointFit& fit, const ViewScatter& scatter,
                         std::size_t index) {
  const double reach = largest_radius(model, index);
  const auto ninth = [&](const JointFrame& frame) -> Eigen::MatrixXd {
    VectorXd d = VectorXd::Zero(2 * static_cast<Index>(frame.points.size()));
    if (frame.camera != index) return d;
    const CamFromTarget pose = model.cameras[index].camera.cam_from_world *
                               model.placements[frame.placement].world_from_target;
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      const Vector3d at = pose * frame.points[i].point_in_target;
      const Vector2d place = at.head<2>() / at.z() / reach;
      d.segment<2>(2 * static_cast<Index>(i)) = place * std::pow(place.squaredNorm(), 4);
    }
    return d;
  };
  const MoreParameters term = fit_more(information_by_view(model, fit, {1, ninth}), 1);
  if (term.p * static_cast<double>(model.cameras.size()) > kFalseAlarms) return "";
  const auto focal = static_cast<Index>(index * moved_camera_parameters(fit).size());
  const double moved_px = std::abs(term.others(focal, 0) * term.estimate[0]);
  const double sigmas = moved_px / std::sqrt(scatter.covariance(focal, focal));
  if (!(sigmas > kHarmSigmas)) return "";
  return fmt::format(
      "{}: its lens is wider than the lens model: a radial term of ninth order is missing, which "
      "moves the focal length by {:.1f} px, {:.0f} standard deviations, with points up to {:.0f} "
      "deg off the axis; {}",
      model.cameras[index].camera.name, moved_px, sigmas, std::atan(reach) / units::deg, kRemedy);
}

}  // namespace

std::string wide_lens(const JointModel& model, JointFit fit) {
  fit.lens = LensTerms::k1_k2_p1_p2_k3;
  const ViewScatter scatter = scatter_of_views(model, fit, 1);
  for (std::size_t c = 0; c < model.cameras.size(); ++c) {
    if (std::string reason = fisheye(model, c); !reason.empty()) return reason;
    if (scatter.covariance.size() == 0) continue;
    if (std::string reason = missing_term(model, fit, scatter, c); !reason.empty()) return reason;
  }
  return "";
}

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/positions.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "core/camera_derivatives.hpp"
#include "core/dot_image.hpp"
#include "core/geometry/next_pose.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;

/// Mean distance (m) between common points; nullopt if there are none.
std::optional<double> mean_shift_m(const Position& a, const Position& b) {
  double sum_mm = 0;
  int common = 0;
  for (const auto& [mark, point] : a.points) {
    const auto same = b.points.find(mark);
    if (same == b.points.end()) continue;
    sum_mm += (point.in_world_mm - same->second.in_world_mm).norm();
    ++common;
  }
  if (common == 0) return std::nullopt;
  return sum_mm * units::mm / common;
}

struct Seen {
  const Camera* camera = nullptr;
  Index parameters_at = 0;
  const Detection* detection = nullptr;
};

std::optional<MeasuredPoint> point_from(const std::vector<Seen>& views, Index parameters) {
  constexpr double kLeastAngle = 2 * units::deg;
  std::vector<PixelView> pixels;
  for (const Seen& view : views)
    pixels.push_back({view.camera, view.detection->centre_px, view.detection->covariance_px2});
  const PointFit fit = fit_point(pixels, kLeastAngle);
  if (fit.status != PointStatus::good) return std::nullopt;
  MeasuredPoint point{
      fit.in_world / units::mm,
      fit.by_pixels * fit.covariance_px2 * fit.by_pixels.transpose() / (units::mm * units::mm),
      Eigen::Matrix3Xd::Zero(3, parameters)};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto by_parameters = d_px_d_parameters(*views[i].camera, fit.in_world);
    if (!by_parameters) return std::nullopt;
    point.by_calibration_mm.middleCols(views[i].parameters_at, by_parameters->cols()) =
        -fit.by_pixels.middleCols<2>(2 * static_cast<Index>(i)) * *by_parameters / units::mm;
  }
  return point;
}

}  // namespace

std::map<MarkId, MeasuredPoint> measured_points(const Detections& detections,
                                                const Calibration& calibration,
                                                const std::string& set) {
  std::map<MarkId, std::vector<Seen>> views;
  Index at = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    for (const FrameDetections& frame : detections.frames) {
      if (frame.set != set || frame.camera != camera.camera.name) continue;
      for (const Detection& d : frame.detections) views[d.mark].push_back({&camera.camera, at, &d});
    }
    at += static_cast<Index>(parameter_names(camera.camera.model).size());
  }
  std::map<MarkId, MeasuredPoint> points;
  for (const auto& [mark, seen] : views) {
    if (seen.size() < 2) continue;
    if (auto point = point_from(seen, at)) points.emplace(mark, std::move(*point));
  }
  return points;
}

using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::mm;

Plate::Plate(Target described, const Vector2d& bow_mm) : target(std::move(described)) {
  Vector2d half = Vector2d::Constant(1e-9), squares = Vector2d::Zero();
  for (const Vector3d& point : points_of(target)) {
    half = half.cwiseMax(point.head<2>().cwiseAbs());
    squares += point.head<2>().cwiseAbs2();
  }
  bow.half_m = half;
  bow.mean = squares.cwiseQuotient(half.cwiseAbs2()) / (target.rows * target.cols);
  bow.edge_rise_mm = bow_mm;
}

std::vector<std::string> sets_of(const Detections& detections) {
  std::vector<std::string> sets;
  for (const FrameDetections& frame : detections.frames) {
    if (std::find(sets.begin(), sets.end(), frame.set) == sets.end()) sets.push_back(frame.set);
  }
  return sets;
}

std::vector<Position> positions_of(const Detections& detections, const Calibration& calibration,
                                   const Plate& plate) {
  std::vector<Position> positions;
  for (const std::string& set : sets_of(detections)) {
    Position position{set, measured_points(detections, calibration, set), {}};
    const auto count = static_cast<Eigen::Index>(position.points.size());
    if (count < 4) continue;
    Matrix3Xd flat(3, count), seen(3, count);
    Eigen::Index i = 0;
    for (const auto& [mark, point] : position.points) {
      flat.col(i) = plate.point(mark);
      seen.col(i++) = point.in_world_mm * mm;
    }
    const auto pose = pose_from_points<frame::World, frame::Target>(flat, seen);
    if (!pose) continue;
    position.pose = *pose;
    positions.push_back(std::move(position));
  }
  return positions;
}

int count_places(const std::vector<const Position*>& positions, const Plate& plate) {
  std::vector<const Position*> places;
  for (const Position* position : positions) {
    const bool again = std::any_of(places.begin(), places.end(), [&](const Position* earlier) {
      const auto shift = mean_shift_m(*earlier, *position);
      return shift && *shift < plate.target.pitch_m / 2;
    });
    if (!again) places.push_back(position);
  }
  return static_cast<int>(places.size());
}

Detections without_eccentricity(Detections detections, const Calibration& calibration,
                                const Plate& plate, const std::vector<Position>& positions) {
  const double radius_m = plate.target.dot_diameter_m / 2;
  if (!(radius_m > 0)) return detections;
  for (FrameDetections& frame : detections.frames) {
    const auto position =
        std::find_if(positions.begin(), positions.end(),
                     [&](const Position& candidate) { return candidate.set == frame.set; });
    const CalibratedCamera* own = calibration.find(frame.camera);
    if (position == positions.end() || own == nullptr) continue;
    const CamFromTarget pose = own->camera.cam_from_world * position->pose;
    for (Detection& d : frame.detections) {
      if (const auto off = eccentricity_px(
              own->camera.model,
              {pose * plate.point(d.mark), pose.rotation.col(0), pose.rotation.col(1), radius_m}))
        d.centre_px -= *off;
    }
  }
  return detections;
}

}  // namespace drape::calib

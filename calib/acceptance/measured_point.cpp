// SPDX-License-Identifier: Apache-2.0
#include "calib/acceptance/measured_point.hpp"

#include <vector>

#include "core/camera_derivatives.hpp"
#include "core/geometry/point.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using Eigen::Index;

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

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#include "console/coach/coach.hpp"

#include <cmath>
#include <map>

#include "core/dot_image.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/rigid_motion.hpp"

namespace drape::console {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kLeastPoints = 8;

/// Image of a dot's centre. The centroid of its disc deviates from it (eccentricity; Heikkila 2000)
/// by an amount that the pose determines.
Vector2d centre_px(const Camera& camera, const Target& target,
                   const std::optional<WorldFromTarget>& pose, const Detection& dot) {
  if (!pose || target.dot_diameter_m == 0) return dot.centre_px;
  const CamFromTarget seen = camera.cam_from_world * *pose;
  const auto off =
      eccentricity_px(camera.model, {seen * target.point_in_target(dot.mark), seen.rotation.col(0),
                                     seen.rotation.col(1), 0.5 * target.dot_diameter_m});
  return off ? Vector2d(dot.centre_px - *off) : dot.centre_px;
}

std::optional<MeasuredTarget> measure_with(const Calibration& calibration, const Target& target,
                                           const std::vector<FrameDetections>& frames,
                                           const std::optional<WorldFromTarget>& pose) {
  std::map<MarkId, std::vector<Ray>> rays;
  for (const FrameDetections& frame : frames) {
    const CalibratedCamera* found = calibration.find(frame.camera);
    if (found == nullptr) continue;
    for (const Detection& dot : frame.detections)
      if (const auto ray = ray_of(found->camera, centre_px(found->camera, target, pose, dot)))
        rays[dot.mark].push_back(*ray);
  }
  MeasuredTarget result;
  Eigen::Matrix3Xd drawn(3, rays.size()), measured(3, rays.size());
  for (const auto& [mark, seen_along] : rays) {
    const auto point = nearest_to_rays(seen_along);
    if (!point) continue;
    drawn.col(result.points) = target.point_in_target(mark);
    measured.col(result.points++) = *point;
  }
  if (result.points < kLeastPoints) return std::nullopt;
  drawn.conservativeResize(3, result.points);
  measured.conservativeResize(3, result.points);
  const auto pose_of_points = pose_from_points<frame::World, frame::Target>(drawn, measured);
  if (!pose_of_points) return std::nullopt;
  result.world_from_target = *pose_of_points;
  double sum = 0;
  for (Index k = 0; k < measured.cols(); ++k) {
    sum += (result.world_from_target * Vector3d(drawn.col(k)) - measured.col(k)).squaredNorm();
    result.points_in_world.emplace_back(measured.col(k));
  }
  result.rms_m = std::sqrt(sum / result.points);
  return result;
}

}  // namespace

std::optional<MeasuredTarget> measure_target(const Calibration& calibration, const Target& target,
                                             const std::vector<FrameDetections>& frames) {
  const auto first = measure_with(calibration, target, frames, {});
  return first ? measure_with(calibration, target, frames, first->world_from_target) : first;
}

}  // namespace drape::console

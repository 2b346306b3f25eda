// SPDX-License-Identifier: Apache-2.0
#include "capture/live/still.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "capture/live/motion.hpp"
#include "core/calibration.hpp"
#include "core/error.hpp"
#include "core/recording.hpp"

namespace drape::capture {
namespace {

constexpr std::size_t kMostCompared = 8;  ///< frames of a long burst, evenly chosen

GreyView view(const LiveFrame& frame) {
  return {frame.pixels, frame.width_px, frame.height_px};
}

/// Millimetres that one pixel spans where the camera saw the target.
std::optional<double> mm_per_px(const std::optional<Calibration>& calibration,
                                const std::string& name) {
  if (!calibration) return std::nullopt;
  for (const CalibratedCamera& camera : calibration->cameras) {
    if (camera.camera.name != name) continue;
    const auto projection = project(
        camera.camera.model, camera.camera.cam_from_world * camera.worked_point.point_in_world);
    if (!projection) return std::nullopt;
    const Eigen::Matrix<double, 2, 3> px_per_m = projection->d_px_d_point;
    const double across = px_per_m.jacobiSvd().singularValues()(1);
    if (!(across > 0)) return std::nullopt;
    return 1e3 / across;
  }
  return std::nullopt;
}

/// Sets to compare with the first: all, or evenly chosen ones up to the last.
std::vector<std::size_t> compared(std::size_t sets) {
  std::vector<std::size_t> chosen;
  const std::size_t others = sets - 1, count = std::min(others, kMostCompared);
  for (std::size_t i = 1; i <= count; ++i) chosen.push_back(i * others / count);
  return chosen;
}

void look_at_burst(const LiveResult& live, std::size_t c, const std::optional<double>& scale_mm,
                   CameraStill& camera) {
  const auto& sets = live.pairing.sets;
  const LiveFrame& first = live.frames[sets[0].frames[c]];
  for (const std::size_t k : compared(sets.size())) {
    const LiveFrame& other = live.frames[sets[k].frames[c]];
    if (other.width_px != first.width_px || other.height_px != first.height_px) continue;
    const MotionResult motion = block_motion(view(first), view(other), {});
    if (motion.textured == 0) continue;
    const double largest = motion.largest_px();
    camera.motion_px = std::max(camera.motion_px.value_or(0), largest);
    camera.lost = camera.lost || 10 * motion.lost > motion.textured;
    if (!scale_mm || !first.mark.time_s || !other.mark.time_s) continue;
    const double passed_s = *other.mark.time_s - *first.mark.time_s;
    if (passed_s > 0)
      camera.speed_mm_per_s =
          std::max(camera.speed_mm_per_s.value_or(0), largest * *scale_mm / passed_s);
  }
}

std::optional<double> shift_of(const LiveFrame& now, const Recording& reference,
                               const std::string& set_name, const std::string& camera) {
  const FrameSet& set = reference.set(set_name);
  for (const RecordedFrame& frame : set.frames) {
    if (frame.camera != camera) continue;
    const cv::Mat image = cv::imdecode(read_frame(reference, set, frame), cv::IMREAD_GRAYSCALE);
    if (image.cols != now.width_px || image.rows != now.height_px) return std::nullopt;
    return background_shift_px({{image.data, image.total()}, image.cols, image.rows}, view(now));
  }
  return std::nullopt;
}

void keep_larger(std::optional<double>& largest, const std::optional<double>& value) {
  if (value) largest = std::max(largest.value_or(0), *value);
}

}  // namespace

std::optional<LiveFault> StillReport::cloth_fault() const {
  if (!cloth_moved) return std::nullopt;
  return LiveFault{
      "",
      fmt::format("the cloth moved by {:.2f} px or more during the burst", motion_px.value_or(0)),
      "wait until it hangs still and keep draughts away"};
}

StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                       const StillOptions& options) {
  StillReport report;
  if (live.pairing.sets.empty()) return report;
  std::optional<Calibration> calibration;
  if (options.calibration) calibration = read_calibration(*options.calibration);
  std::optional<Recording> reference;
  if (cameras.reference) reference = read_recording(cameras.reference->recording);
  double spread_s = 0;
  for (const PairedFrames& set : live.pairing.sets)
    spread_s = std::max(spread_s, set.spread_s.value_or(0));
  for (std::size_t c = 0; c < cameras.cameras.size(); ++c) {
    CameraStill camera{cameras.cameras[c].name, {}, {}, {}, false};
    const auto scale_mm = mm_per_px(calibration, camera.name);
    if (live.pairing.sets.size() > 1) look_at_burst(live, c, scale_mm, camera);
    if (reference)
      camera.background_shift_px = shift_of(live.frames[live.pairing.sets[0].frames[c]], *reference,
                                            cameras.reference->set, camera.name);
    if (camera.background_shift_px.value_or(0) > options.largest_shift_px)
      report.moved_cameras.push_back(
          {camera.name,
           fmt::format("it moved since the reference set: its background by {:.2f} px",
                       *camera.background_shift_px),
           "lock the camera and calibrate anew"});
    report.cloth_moved = report.cloth_moved || camera.lost ||
                         camera.motion_px.value_or(0) > options.largest_motion_px;
    keep_larger(report.motion_px, camera.motion_px);
    keep_larger(report.speed_mm_per_s, camera.speed_mm_per_s);
    keep_larger(report.background_shift_px, camera.background_shift_px);
    report.cameras.push_back(camera);
  }
  if (report.speed_mm_per_s) report.sync_error_mm = *report.speed_mm_per_s * spread_s;
  return report;
}

}  // namespace drape::capture

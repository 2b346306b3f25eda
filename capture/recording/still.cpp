// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/still.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "capture/recording/motion.hpp"
#include "core/calibration.hpp"
#include "core/error.hpp"
#include "core/numbers/order.hpp"
#include "core/recording.hpp"

namespace drape::capture {
namespace {

constexpr std::size_t kAllCompared = 8;  ///< then every frame whose number is a power of two
constexpr std::size_t kLeastBlocks = 4;
constexpr double kBeyondFine_px = 2.5;  ///< blocks of the full picture are followed up to 3 px

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

/// Of all blocks; 0 when hardly one was found.
double median_px(const MotionResult& motion) {
  std::vector<double> lengths;
  for (const BlockMotion& b : motion.blocks) lengths.push_back(std::hypot(b.dx_px, b.dy_px));
  if (lengths.size() < kLeastBlocks) return 0;
  return median(std::move(lengths));
}

std::optional<double> shift_of(const LiveFrame& now, const Recording& reference,
                               const std::string& set_name, const std::string& camera) {
  const FrameSet& set = reference.set(set_name);
  for (const RecordedFrame& frame : set.frames) {
    if (frame.camera != camera) continue;
    const cv::Mat image = cv::imdecode(read_frame(reference, set, frame),
                                       cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
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
      motion_px ? fmt::format("the cloth moved by {:.2f} px or more during the burst", *motion_px)
                : "the cloth moved farther than can be followed during the burst",
      "wait until it hangs still and keep draughts away"};
}

StillWatch::StillWatch(const CamerasFile& cameras, const StillOptions& options)
    : cameras_(cameras), options_(options) {
  if (options_.calibration) calibration_ = read_calibration(*options_.calibration);
  if (cameras_.reference) reference_ = read_recording(cameras_.reference->recording);
  for (const LiveCamera& camera : cameras_.cameras)
    report_.cameras.push_back({camera.name, {}, {}, {}, false});
}

void StillWatch::look(const LiveSet& set) {
  spread_s_ = std::max(spread_s_, set.spread_s.value_or(0));
  const std::size_t k = seen_++;
  const bool compared = k > 0 && (k <= kAllCompared || std::has_single_bit(k));
  for (std::size_t c = 0; c < set.frames.size(); ++c) {
    const LiveFrame& now = set.frames[c];
    if (k == 0) {
      first_.push_back({now.mark, now.width_px, now.height_px, {}, now.pixels});
    } else if (compared && now.pixels.size() == first_[c].pixels.size()) {
      look_at_motion(c, now);
    }
    if (reference_) look_at_place(c, now);
  }
  if (report_.speed_mm_per_s) report_.sync_error_mm = *report_.speed_mm_per_s * spread_s_;
}

void StillWatch::look_at_motion(std::size_t c, const LiveFrame& now) {
  CameraStill& camera = report_.cameras[c];
  const LiveFrame& first = first_[c];
  const MotionResult fine = block_motion(view(first), view(now), {});
  // A pattern that repeats looks still when it moves by its period: its outlines do not.
  MotionOptions far;
  far.shrink = 8;
  far.block_px = 128;
  far.largest_px = 6;
  far.largest_sd_px = 0.5;
  const double coarse_px = median_px(block_motion(view(first), view(now), far));
  camera.lost = camera.lost || 10 * fine.lost > fine.textured;
  std::optional<double> largest;
  if (coarse_px > kBeyondFine_px) {
    largest = coarse_px;
  } else if (!camera.lost && !fine.blocks.empty()) {
    largest = fine.largest_px();
  }
  keep_larger(camera.motion_px, largest);
  if (camera.lost && !largest) camera.motion_px.reset();
  report_.cloth_moved = report_.cloth_moved || camera.lost ||
                        camera.motion_px.value_or(0) > options_.largest_motion_px;
  const auto scale_mm = mm_per_px(calibration_, camera.name);
  if (largest && scale_mm && first.mark.time_s && now.mark.time_s) {
    const double passed_s = *now.mark.time_s - *first.mark.time_s;
    if (passed_s > 0) keep_larger(camera.speed_mm_per_s, *largest * *scale_mm / passed_s);
  }
  keep_larger(report_.speed_mm_per_s, camera.speed_mm_per_s);
  report_.motion_px.reset();
  for (const CameraStill& other : report_.cameras) {
    if (other.lost && !other.motion_px) {
      report_.motion_px.reset();
      return;
    }
    keep_larger(report_.motion_px, other.motion_px);
  }
}

void StillWatch::look_at_place(std::size_t c, const LiveFrame& now) {
  CameraStill& camera = report_.cameras[c];
  const auto shift = shift_of(now, *reference_, cameras_.reference->set, camera.name);
  keep_larger(camera.background_shift_px, shift);
  keep_larger(report_.background_shift_px, shift);
  if (shift.value_or(0) <= options_.largest_shift_px) return;
  const bool known = std::any_of(report_.moved_cameras.begin(), report_.moved_cameras.end(),
                                 [&](const LiveFault& f) { return f.camera == camera.name; });
  if (!known)
    report_.moved_cameras.push_back(
        {camera.name,
         fmt::format("it moved since the reference set: its background by {:.2f} px", *shift),
         "lock the camera and calibrate again"});
}

StillReport look_still(const LiveResult& live, const CamerasFile& cameras,
                       const StillOptions& options) {
  StillWatch watch(cameras, options);
  for (const PairedFrames& set : live.pairing.sets) {
    LiveSet one{set.spread_s, {}, set.trigger, {}};
    for (const std::size_t i : set.frames) one.frames.push_back(live.frames[i]);
    watch.look(one);
  }
  return live.pairing.sets.empty() ? StillReport{} : watch.report();
}

}  // namespace drape::capture

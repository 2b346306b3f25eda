// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/still.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "core/calibration.hpp"
#include "core/error.hpp"
#include "core/parallel.hpp"
#include "core/recording.hpp"
#include "core/statistics/sample.hpp"

namespace drape::capture {
namespace {

constexpr std::size_t kLeastBlocks = 4;
constexpr double kBeyondFine_px = 2.5;  ///< blocks of the full picture are tracked up to 3 px

GreyView view(const LiveFrame& frame) {
  return {frame.pixels, frame.width_px, frame.height_px};
}

/// Millimetres per pixel at the position where the camera saw the target.
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

/// Median motion of all blocks; 0 if too few were matched.
double median_px(const MotionResult& motion) {
  std::vector<double> lengths;
  for (const BlockMotion& b : motion.blocks) lengths.push_back(std::hypot(b.dx_px, b.dy_px));
  if (lengths.size() < kLeastBlocks) return 0;
  return median(std::move(lengths));
}

/// Background of a camera's picture in the reference set.
Background background_of(const Recording& reference, const CamerasFile& cameras,
                         const LiveCamera& camera) {
  const FrameSet& set = reference.set(cameras.reference->set);
  const auto unfit = [&](std::string what) {
    return bad_input(std::move(what),
                     {.file = cameras.file.string(),
                      .field = "reference.set",
                      .camera = camera.name,
                      .set = set.name},
                     "record the bench without a cloth with this rig, something with texture in "
                     "view, or leave [reference] out");
  };
  const auto frame = std::find_if(set.frames.begin(), set.frames.end(),
                                  [&](const RecordedFrame& f) { return f.camera == camera.name; });
  if (frame == set.frames.end()) throw unfit("the reference set has no picture of this camera");
  const cv::Mat image = cv::imdecode(read_frame(reference, set, *frame),
                                     cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
  const CameraSettings& rig = camera.settings;
  if (image.cols != rig.width_px || image.rows != rig.height_px)
    throw unfit(fmt::format("the reference picture has {} x {} px, the rig says {} x {} px",
                            image.cols, image.rows, rig.width_px.value_or(0),
                            rig.height_px.value_or(0)));
  Background background({{image.data, image.total()}, image.cols, image.rows});
  if (!background.is_textured())
    throw unfit("the reference picture has no texture above its noise that tells of a motion");
  return background;
}

MotionOptions coarse_options() {
  MotionOptions options;
  options.shrink = 8;
  options.block_px = 128;
  options.largest_px = 6;
  options.largest_sd_px = 0.5;
  return options;
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

std::vector<std::string> StillReport::not_judged() const {
  std::vector<std::string> names;
  for (const CameraStill& camera : cameras)
    if (camera.not_judged && !cloth_moved) names.push_back(camera.name);
  return names;
}

StillWatch::StillWatch(const CamerasFile& cameras, const StillOptions& options)
    : options_(options) {
  if (options_.calibration) calibration_ = read_calibration(*options_.calibration);
  if (calibration_ && calibration_->no_go) {
    report_.calibration_no_go = calibration_->no_go;
    calibration_.reset();  // a NO-GO calibration cannot be trusted
  }
  std::optional<Recording> reference;
  if (cameras.reference) reference = read_recording(cameras.reference->recording);
  for (const LiveCamera& camera : cameras.cameras) {
    if (reference) backgrounds_.push_back(background_of(*reference, cameras, camera));
    report_.cameras.emplace_back().name = camera.name;
  }
}

void StillWatch::look(const LiveSet& set) {
  spread_s_ = std::max(spread_s_, set.spread_s.value_or(0));
  std::vector<Sight> sights(set.frames.size());
  parallel_for(sights.size(), static_cast<int>(sights.size()),
               [&](std::size_t c) { sights[c] = see(c, set.frames[c]); });
  const bool is_first = first_.empty();
  for (std::size_t c = 0; c < sights.size(); ++c) {
    if (is_first) {
      first_.push_back(std::move(*sights[c].first));
    } else {
      add_motion(c, set.frames[c], sights[c]);
    }
    if (!backgrounds_.empty()) add_place(c, sights[c]);
  }
  if (report_.speed_mm_per_s) report_.sync_error_mm = *report_.speed_mm_per_s * spread_s_;
}

StillWatch::Sight StillWatch::see(std::size_t c, const LiveFrame& now) const {
  Sight sight;
  if (first_.empty()) {
    sight.first = First{BlockFollower(view(now), {}), BlockFollower(view(now), coarse_options()),
                        now.mark.time_s};
  } else if (first_[c].fine.has_size_of(view(now))) {
    sight.fine = first_[c].fine.motion_to(view(now));
    sight.coarse = first_[c].coarse.motion_to(view(now));
    if (sight.fine.blocks.empty()) sight.edges = first_[c].fine.motion_across_edges_to(view(now));
  }
  if (!backgrounds_.empty()) sight.background_shift_px = backgrounds_[c].shift_px(view(now));
  return sight;
}

void StillWatch::add_motion(std::size_t c, const LiveFrame& now, const Sight& sight) {
  CameraStill& camera = report_.cameras[c];
  const MotionResult& fine = sight.fine;
  const double coarse_px = median_px(sight.coarse);
  camera.lost = camera.lost || fine.is_lost() || sight.edges.gone > 0;
  std::optional<double> largest;
  if (coarse_px > kBeyondFine_px) {
    largest = coarse_px;
  } else if (!camera.lost && !fine.blocks.empty()) {
    largest = fine.largest_px();
  } else if (const double across_px = sight.edges.largest_px();
             across_px > options_.largest_motion_px) {
    largest = across_px;
  }
  camera.not_judged = camera.not_judged || (!largest && !camera.lost);
  keep_larger(camera.motion_px, largest);
  if (camera.lost && !largest) camera.motion_px.reset();
  report_.cloth_moved = report_.cloth_moved || camera.lost ||
                        camera.motion_px.value_or(0) > options_.largest_motion_px;
  const auto scale_mm = mm_per_px(calibration_, camera.name);
  if (largest && scale_mm && first_[c].time_s && now.mark.time_s) {
    const double passed_s = *now.mark.time_s - *first_[c].time_s;
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

void StillWatch::add_place(std::size_t c, const Sight& sight) {
  CameraStill& camera = report_.cameras[c];
  const auto& shift_px = sight.background_shift_px;
  if (!shift_px) camera.background_lost = true;
  keep_larger(camera.background_shift_px, shift_px);
  if (camera.background_lost) camera.background_shift_px.reset();
  report_.background_shift_px.reset();
  const bool any_lost = std::any_of(report_.cameras.begin(), report_.cameras.end(),
                                    [](const CameraStill& one) { return one.background_lost; });
  for (const CameraStill& one : report_.cameras)
    if (!any_lost) keep_larger(report_.background_shift_px, one.background_shift_px);
  if (shift_px && *shift_px <= options_.largest_shift_px) return;
  const bool known = std::any_of(report_.moved_cameras.begin(), report_.moved_cameras.end(),
                                 [&](const LiveFault& f) { return f.camera == camera.name; });
  if (known) return;
  if (shift_px)
    report_.moved_cameras.push_back(
        {camera.name,
         fmt::format("it moved since the reference set: its background by {:.2f} px", *shift_px),
         "lock the camera and calibrate again"});
  else
    report_.moved_cameras.push_back(
        {camera.name,
         fmt::format("its background is not found again in the reference set: it moved by more "
                     "than {:.0f} px, or the cloth covers the background",
                     backgrounds_[c].reach_px()),
         "lock the camera and calibrate again; or let it see more of the bench beside the cloth"});
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

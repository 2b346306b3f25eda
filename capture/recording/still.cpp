// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/record.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "core/parallel.hpp"
#include "core/recording.hpp"
#include "core/statistics/sample.hpp"

namespace drape::capture {

namespace following {

struct Block {
  int x0, y0, side;
};

/// Sums over one block of the first picture.
struct Normal {
  double xx = 0, xy = 0, yy = 0;  ///< sums of products of gradients about their mean
  double mean_x = 0, mean_y = 0, mean = 0, variance = 0;
  [[nodiscard]] double smallest() const { return 0.5 * (xx + yy - std::hypot(xx - yy, 2 * xy)); }
  [[nodiscard]] double largest() const { return 0.5 * (xx + yy + std::hypot(xx - yy, 2 * xy)); }
  /// Direction of the dominant gradient, from +x.
  [[nodiscard]] double angle_rad() const { return 0.5 * std::atan2(2 * xy, xx - yy); }
};

}  // namespace following

namespace {

using following::Block, following::Normal;
using Plane = cv::Mat1f;

constexpr int kIterations = 25;
constexpr double kConverged_px = 1e-3;
constexpr double kTextureOfNoise = 4.0;  ///< multiple of the noise's gradients that texture exceeds
constexpr double kOverNoise = 1.5;       ///< and more than this multiple of the block's own noise

/// Noise of variance n in the difference of two pictures lowers the correlation of a block of
/// variance v to 1 - n / (2 v): to 0.7 for v = 1.7 n, to 0.94 for v = 8 n.
constexpr double kHiddenByNoise = 8.0;

/// Variance of rounding a grey level.
constexpr double kOfRounding = 1.0 / 12;

/// Averages squares of `factor` x `factor` pixels.
Plane shrunk(const GreyView& view, int factor) {
  const cv::Mat1b full(view.height_px, view.width_px,
                       const_cast<std::uint8_t*>(view.pixels.data()));  // only read
  Plane plane(view.height_px / factor, view.width_px / factor);
  for (int y = 0; y < plane.rows; ++y)
    for (int x = 0; x < plane.cols; ++x) {
      int sum = 0;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i) sum += full(y * factor + j, x * factor + i);
      plane(y, x) = static_cast<float>(sum) / static_cast<float>(factor * factor);
    }
  return plane;
}

double slope_x(const Plane& p, int x, int y) {
  return 0.5 * (p(y, x + 1) - p(y, x - 1));
}
double slope_y(const Plane& p, int x, int y) {
  return 0.5 * (p(y + 1, x) - p(y - 1, x));
}

Normal normal_of(const Plane& a, const Block& b) {
  Normal n;
  const double count = static_cast<double>(b.side) * b.side;
  for (int y = b.y0; y < b.y0 + b.side; ++y)
    for (int x = b.x0; x < b.x0 + b.side; ++x) {
      const double gx = slope_x(a, x, y), gy = slope_y(a, x, y), value = a(y, x);
      n.mean_x += gx / count;
      n.mean_y += gy / count;
      n.mean += value / count;
      n.xx += gx * gx;
      n.xy += gx * gy;
      n.yy += gy * gy;
      n.variance += value * value / count;
    }
  n.xx -= count * n.mean_x * n.mean_x;
  n.xy -= count * n.mean_x * n.mean_y;
  n.yy -= count * n.mean_y * n.mean_y;
  n.variance -= n.mean * n.mean;
  return n;
}

/// Second differences, blind to slopes and, by the median, to edges (Immerkaer 1996).
double noise_variance(const Plane& a, const Block& b) {
  std::vector<double> differences;
  for (int y = b.y0; y < b.y0 + b.side; ++y)
    for (int x = b.x0; x < b.x0 + b.side; ++x)
      differences.push_back(std::abs(a(y - 1, x - 1) + a(y - 1, x + 1) + a(y + 1, x - 1) +
                                     a(y + 1, x + 1) + 4 * a(y, x) -
                                     2 * (a(y - 1, x) + a(y + 1, x) + a(y, x - 1) + a(y, x + 1))));
  // The filter amplifies the variance 36 times; a median is 0.6745 standard deviations.
  const double sd = median(std::move(differences)) / (6 * 0.6745);
  return sd * sd;
}

/// Difference between the second picture, shifted by `dx`, `dy`, and the first.
struct Misfit {
  double x = 0, y = 0;        ///< weighted by the gradient, about the means
  double variance = 0;        ///< variance of the difference
  double other_variance = 0;  ///< variance of the second picture
};

Misfit misfit_of(const Plane& a, const Plane& b, const Block& block, const Normal& n, double dx,
                 double dy) {
  Misfit m;
  double sum = 0, other = 0;
  const double count = static_cast<double>(block.side) * block.side;
  // Bilinear interpolation, with the same weights for the whole block.
  const int column = static_cast<int>(std::floor(dx)), row = static_cast<int>(std::floor(dy));
  const double u = dx - column, v = dy - row;
  for (int y = block.y0; y < block.y0 + block.side; ++y) {
    const float *here = a[y], *above = a[y - 1], *below = a[y + 1];
    const float *first = b[y + row] + column, *second = b[y + row + 1] + column;
    for (int x = block.x0; x < block.x0 + block.side; ++x) {
      const double value = (1 - v) * ((1 - u) * first[x] + u * first[x + 1]) +
                           v * ((1 - u) * second[x] + u * second[x + 1]);
      const double e = value - here[x];
      sum += e;
      other += value;
      m.x += (0.5 * (here[x + 1] - here[x - 1]) - n.mean_x) * e;
      m.y += (0.5 * (below[x] - above[x]) - n.mean_y) * e;
      m.variance += e * e;
      m.other_variance += value * value;
    }
  }
  sum /= count;
  other /= count;
  m.variance /= count;
  m.other_variance /= count;
  m.variance = std::max(0.0, m.variance - sum * sum);
  m.other_variance = std::max(0.0, m.other_variance - other * other);
  return m;
}

bool inside(const Plane& p, const Block& b, double dx, double dy) {
  return b.x0 + dx >= 0 && b.y0 + dy >= 0 && b.x0 + b.side + dx < p.cols - 1 &&
         b.y0 + b.side + dy < p.rows - 1;
}

/// Directions in which a block is tracked: both, or only across its edges.
enum class Along { both, gradient };

/// Motion of the block in px of the planes; nullopt if it is lost.
std::optional<BlockMotion> follow(const Plane& a, const Plane& b, const Block& block,
                                  const Normal& n, const MotionOptions& options, Along along) {
  BlockMotion motion;
  motion.sd_px = std::numeric_limits<double>::infinity();  // until converged
  const double determinant = n.xx * n.yy - n.xy * n.xy;
  Misfit m;
  for (int i = 0; i < kIterations; ++i) {
    if (!inside(b, block, motion.dx_px, motion.dy_px)) return std::nullopt;
    m = misfit_of(a, b, block, n, motion.dx_px, motion.dy_px);
    double step_x = -(n.yy * m.x - n.xy * m.y) / determinant;
    double step_y = -(n.xx * m.y - n.xy * m.x) / determinant;
    if (along == Along::gradient) {
      const double u = std::cos(n.angle_rad()), v = std::sin(n.angle_rad());
      const double step = -(u * m.x + v * m.y) / n.largest();
      step_x = step * u;
      step_y = step * v;
    }
    motion.dx_px += step_x;
    motion.dy_px += step_y;
    if (std::hypot(motion.dx_px, motion.dy_px) > options.largest_px) return std::nullopt;
    if (std::hypot(step_x, step_y) > kConverged_px) continue;
    motion.sd_px = std::sqrt(m.variance / (along == Along::both ? n.smallest() : n.largest()));
    break;
  }
  motion.residual_variance = m.variance;
  // Covariance from variances: var(b - a) = var(a) + var(b) - 2 cov(a, b).
  const double covariance = 0.5 * (n.variance + m.other_variance - m.variance);
  const double correlation = covariance / std::sqrt(n.variance * m.other_variance + 1e-12);
  if (correlation < options.least_correlation) return std::nullopt;
  return motion;
}

/// Options for the background: averaging 4 x 4 pixels lifts faint texture above the noise. Blocks
/// of 24 x 24 such pixels in a large picture, smaller ones in a small picture: about a hundred.
MotionOptions background_options(const GreyView& reference) {
  constexpr int kShrink = 4, kBlocks = 96, kLeastSide = 12, kLargestSide = 24;
  const int cols = reference.width_px / kShrink, rows = reference.height_px / kShrink;
  const double pixels = static_cast<double>(cols) * rows;
  const int side =
      std::clamp(static_cast<int>(std::sqrt(pixels / kBlocks)), kLeastSide, kLargestSide);
  return {.block_px = kShrink * side, .shrink = kShrink, .largest_sd_px = 0.3};
}

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
  const auto frame = std::ranges::find(set.frames, camera.name, &RecordedFrame::camera);
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

constexpr MotionOptions kCoarse{
    .block_px = 128, .shrink = 8, .largest_px = 6, .largest_sd_px = 0.5};

void keep_larger(std::optional<double>& largest, const std::optional<double>& value) {
  if (value) largest = std::max(largest.value_or(0), *value);
}

}  // namespace

double MotionResult::largest_px() const {
  double largest = 0;
  for (const BlockMotion& b : blocks)
    largest = std::max(largest, std::hypot(b.dx_px, b.dy_px) - 3 * b.sd_px);
  return largest;
}

struct BlockFollower::First {
  struct Textured {
    Block block;
    Normal normal;
  };
  MotionOptions options;
  int width_px, height_px;
  cv::Mat1f plane;
  std::vector<Textured> blocks;
  std::vector<Textured> edges;  ///< blocks with structure in one direction only

  /// Tracks each of the blocks in another picture. Calls `found(block, motion)` or `lost(block)`
  /// for it; the result has the blocks whose motion is certain enough.
  template <class Found, class Lost>
  [[nodiscard]] MotionResult followed(const std::vector<Textured>& from, Along along,
                                      const GreyView& to, const Found& found,
                                      const Lost& lost) const {
    if (width_px != to.width_px || height_px != to.height_px)
      throw usage_error("the pictures differ in size", "compare frames of one camera");
    const Plane now = shrunk(to, options.shrink);
    const double scale = options.shrink;
    MotionResult result;
    result.textured = static_cast<int>(from.size());
    for (const Textured& one : from) {
      const auto motion = follow(plane, now, one.block, one.normal, options, along);
      if (!motion) {
        ++result.lost;
        lost(one);
        continue;
      }
      found(one, *motion);
      if (motion->sd_px * scale > options.largest_sd_px) continue;
      result.blocks.push_back({scale * (one.block.x0 + 0.5 * one.block.side),
                               scale * (one.block.y0 + 0.5 * one.block.side), scale * motion->dx_px,
                               scale * motion->dy_px, scale * motion->sd_px,
                               motion->residual_variance});
    }
    return result;
  }
};

BlockFollower::BlockFollower(const GreyView& from, const MotionOptions& options) {
  First first{options, from.width_px, from.height_px, shrunk(from, options.shrink), {}, {}};
  const int side = options.block_px / options.shrink;
  const double scale = options.shrink;
  for (int y0 = 1; y0 + side + 1 < first.plane.rows; y0 += side)
    for (int x0 = 1; x0 + side + 1 < first.plane.cols; x0 += side) {
      const Block block{x0, y0, side};
      const Normal n = normal_of(first.plane, block);
      // Pure noise gives half its variance per px to each gradient.
      const double count = 0.5 * side * side, least = kTextureOfNoise / (scale * scale);
      if (n.largest() / count < least) continue;
      const double noise = noise_variance(first.plane, block);
      const auto is_texture = [&](double energy) {
        return energy / count >= least && energy / count >= kOverNoise * noise;
      };
      if (is_texture(n.smallest()))
        first.blocks.push_back({block, n});
      else if (is_texture(n.largest()))
        first.edges.push_back({block, n});
    }
  first_ = std::make_shared<const First>(std::move(first));
}

int BlockFollower::textured() const {
  return static_cast<int>(first_->blocks.size());
}

int BlockFollower::findable(const GreyView& from) const {
  const MotionOptions& options = first_->options;
  const Plane full = shrunk(from, 1);  // full resolution separates fine texture from noise best
  const int scale = options.shrink;
  return static_cast<int>(
      std::ranges::count_if(first_->blocks, [&](const First::Textured& textured) {
        const auto& [block, n] = textured;
        const double noise =
            noise_variance(full, {scale * block.x0, scale * block.y0, scale * block.side}) /
            (scale * scale);
        return n.variance - noise >= options.least_correlation * n.variance &&
               scale * std::sqrt(2 * noise / n.smallest()) <= options.largest_sd_px;
      }));
}

bool BlockFollower::has_size_of(const GreyView& other) const {
  return first_->width_px == other.width_px && first_->height_px == other.height_px;
}

MotionResult BlockFollower::motion_to(const GreyView& to) const {
  std::vector<double> noises, levels;  // residual variances and mean grey levels of matched blocks
  std::vector<const Normal*> lost;
  MotionResult result = first_->followed(
      first_->blocks, Along::both, to,
      [&](const First::Textured& one, const BlockMotion& motion) {
        noises.push_back(motion.residual_variance);
        levels.push_back(one.normal.mean);
      },
      [&](const First::Textured& one) { lost.push_back(&one.normal); });
  if (noises.empty()) return result;
  // The variance of shot noise grows at most in proportion to the grey level.
  const double hidden = kHiddenByNoise * median(std::move(noises));
  const double level = median(std::move(levels));
  result.gone = static_cast<int>(std::ranges::count_if(lost, [&](const Normal* n) {
    return n->variance > hidden * std::max(1.0, n->mean / level);
  }));
  return result;
}

MotionResult BlockFollower::motion_across_edges_to(const GreyView& to) const {
  int gone = 0;
  MotionResult result = first_->followed(
      first_->edges, Along::gradient, to, [](const First::Textured&, const BlockMotion&) {},
      [&](const First::Textured& one) {
        const double noise = std::max(kOfRounding, noise_variance(first_->plane, one.block));
        gone += one.normal.variance > kHiddenByNoise * 2 * noise;
      });
  result.gone = gone;
  return result;
}

Background::Background(const GreyView& reference)
    : options_(background_options(reference)),
      blocks_(reference, options_),
      findable_(blocks_.findable(reference)) {}

std::optional<double> Background::shift_px(const GreyView& now) const {
  if (!blocks_.has_size_of(now)) return std::nullopt;
  constexpr std::size_t kQuarters = 4;  // and the whole picture
  std::array<std::vector<double>, kQuarters + 1> x, y;
  for (const BlockMotion& b : blocks_.motion_to(now).blocks) {
    const std::size_t quarter =
        (b.x_px > 0.5 * now.width_px ? 1U : 0U) + (b.y_px > 0.5 * now.height_px ? 2U : 0U);
    for (const std::size_t part : {quarter, kQuarters}) {
      x[part].push_back(b.dx_px);
      y[part].push_back(b.dy_px);
    }
  }
  std::optional<double> largest;
  for (std::size_t part = 0; part < x.size(); ++part)
    if (std::ssize(x[part]) >= kLeastBlocks)
      largest = std::max(largest.value_or(0), std::hypot(median(x[part]), median(y[part])));
  return largest;
}

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
    sight.first =
        First{BlockFollower(view(now), {}), BlockFollower(view(now), kCoarse), now.mark.time_s};
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
  const bool any_lost = std::ranges::any_of(
      report_.cameras, [](const CameraStill& one) { return one.background_lost; });
  for (const CameraStill& one : report_.cameras)
    if (!any_lost) keep_larger(report_.background_shift_px, one.background_shift_px);
  if (shift_px && *shift_px <= options_.largest_shift_px) return;
  const bool known = std::ranges::any_of(
      report_.moved_cameras, [&](const LiveFault& f) { return f.camera == camera.name; });
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

// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "detect/dots/noise.hpp"
#include "detect/families/tag_family.hpp"
#include "detect/targets/board_map.hpp"
#include "detect/targets/chessboard.hpp"
#include "detect/targets/corner_covariance.hpp"
#include "detect/targets/corner_point.hpp"
#include "detect/targets/light_growth.hpp"

namespace drape::detect {
namespace {

using Eigen::Vector2d;

constexpr double kEdge_px = 1;               ///< that a blurred edge takes of the free width
constexpr double kMostPitchFraction = 0.25;  ///< of the window, as for a chessboard
constexpr double kLeastContrastSigmas = 6;
constexpr int kMostGrowth_px = 3;

/// Adds the target's tags that were found to those known; an id seen twice is left out, one of
/// them is wrong.
void add_tags(const std::vector<TagDetection>& found, const Target& target,
              std::map<int, TagDetection>& known) {
  std::map<int, std::vector<TagDetection>> by_id;
  for (const TagDetection& tag : found) {
    const bool ours = std::any_of(target.tags.begin(), target.tags.end(),
                                  [&](const PrintedTag& t) { return t.id == tag.id; });
    if (ours) by_id[tag.id].push_back(tag);
  }
  for (const auto& [id, seen] : by_id)
    if (seen.size() == 1) known.try_emplace(id, seen.front());
}

std::vector<TagDetection> tags_of(const GreyImage& image, const Target& target,
                                  const TagFamily& family, double noise_sigma) {
  std::map<int, TagDetection> known;
  add_tags(family.find(image, noise_sigma), target, known);
  // The small squares of an AprilGrid touch its tags' corners, so that the library takes both for
  // one shape; with light grown into the dark they come apart.
  for (int by_px = 1; target.kind == TargetKind::aprilgrid && by_px <= kMostGrowth_px; ++by_px) {
    if (known.size() == target.tags.size()) break;
    std::vector<TagDetection> found = family.find(with_light_grown(image, by_px), noise_sigma);
    for (TagDetection& tag : found) tag.corners_px = without_growth(tag.corners_px, by_px);
    add_tags(found, target, known);
  }
  std::vector<TagDetection> tags;
  tags.reserve(known.size());
  for (const auto& [id, tag] : known) tags.push_back(tag);
  return tags;
}

/// Width around a corner in which only its own edges lie: in a ChArUco board up to the tags, in an
/// AprilGrid up to the far side of the small squares or the rim's inner edge.
double free_width_m(const Target& target, const TagFamily& family) {
  const double gap = target.pitch_m - target.tag_edge_m;
  if (target.kind == TargetKind::charuco)
    return std::min(gap / 2, kMostPitchFraction * target.pitch_m);
  return std::min(gap, target.tag_edge_m * target.tag_border / family.edge_modules());
}

Vector2d image_of(const Eigen::Matrix3d& map, const Vector2d& point_m) {
  return (map * point_m.homogeneous()).hnormalized();
}

/// What one corner's surroundings look like in the picture.
struct Surroundings {
  Vector2d px;
  double free_px = 0;     ///< to the nearest side of the free square's image
  Vector2d diagonals[4];  ///< middles of the four quarters around it
};

Surroundings surroundings_of(const Eigen::Matrix3d& map, const Vector2d& point_m, double free_m) {
  Surroundings around{image_of(map, point_m), std::numeric_limits<double>::infinity(), {}};
  int k = 0;
  for (const Vector2d& diagonal :
       {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)}) {
    const Vector2d along(diagonal.x(), 0), across(0, diagonal.y());
    // Seen aslant the free square is a rhomboid, whose sides are nearer than the ends of its arms.
    const Vector2d a = image_of(map, point_m + free_m * along) - around.px;
    const Vector2d b = image_of(map, point_m + free_m * across) - around.px;
    const double area = std::abs(a.x() * b.y() - a.y() * b.x());
    around.free_px = std::min(around.free_px, area / std::max(a.norm(), b.norm()));
    around.diagonals[k++] = image_of(map, point_m + 0.6 * free_m * diagonal);
  }
  return around;
}

/// Difference of the two pairs of opposite quarters, grey levels; nothing at the image's border.
std::optional<double> contrast_at(const GreyImage& image, const Surroundings& around) {
  double level[4];
  for (int k = 0; k < 4; ++k) {
    const int x = static_cast<int>(std::lround(around.diagonals[k].x()));
    const int y = static_cast<int>(std::lround(around.diagonals[k].y()));
    if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) return std::nullopt;
    level[k] = image.level(x, y);
  }
  return std::abs(level[0] + level[2] - level[1] - level[3]) / 2;
}

/// Measures the corners of one frame, one after the other.
class CornerReader {
 public:
  CornerReader(const GreyImage& image, double free_m, double noise_sigma, FrameDetections& frame)
      : image_(image), free_m_(free_m), noise_sigma_(noise_sigma), frame_(frame) {}

  void read(MarkId mark, const Vector2d& point_m, const Eigen::Matrix3d& map) {
    const Surroundings around = surroundings_of(map, point_m, free_m_);
    const std::optional<double> contrast = contrast_at(image_, around);
    if (!contrast) return;  // Outside the picture: nothing was there to be found.
    const int half_window = static_cast<int>(std::floor(around.free_px - kEdge_px));
    if (half_window < kLeastHalfWindow_px) {
      return reject(mark, around.px,
                    fmt::format("too small: {:.1f} px are free around the corner", around.free_px));
    }
    if (*contrast < kLeastContrastSigmas * noise_sigma_) {
      return reject(mark, around.px,
                    fmt::format("no corner where the tags have it: covered or glare, contrast "
                                "{:.0f} grey levels",
                                *contrast));
    }
    const auto point = find_corner_point(image_, around.px, half_window);
    if (!point || (point->centre_px - around.px).norm() > std::max(1.0, 0.5 * half_window)) {
      return reject(mark, around.px, "the edges around the corner do not meet in one point");
    }
    points.push_back(*point);
    frame_.detections.push_back({mark, point->centre_px, Eigen::Matrix2d::Identity(),
                                 Vector2d::Constant(point->half_window_px), 0, *contrast, 0});
  }

  std::vector<CornerPoint> points;

 private:
  void reject(MarkId mark, const Vector2d& px, const std::string& reason) {
    frame_.rejections.push_back({mark, px, reason});
  }

  const GreyImage& image_;
  double free_m_, noise_sigma_;
  FrameDetections& frame_;
};

FrameDetections detect_face(const GreyImage& image, const Target& target) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  const TagFamily family(target.tag_family, target.tag_border);
  const double noise_sigma = estimate_noise(image).sigma(128);
  frame.noise_sigma = noise_sigma;
  frame.tags = tags_of(image, target, family, noise_sigma);
  if (frame.tags.empty()) return frame;
  const BoardMap board(target, frame.tags);
  CornerReader reader(image, free_width_m(target, family), noise_sigma, frame);
  for (int row = 0; row < target.rows; ++row) {
    for (int col = 0; col < target.cols; ++col) {
      const Vector2d point_m = target.point_in_target({row, col}).head<2>();
      if (const auto map = board.around(point_m)) reader.read({row, col}, point_m, *map);
    }
  }
  set_corner_covariances(target, reader.points, frame);
  return frame;
}

GreyImage mirrored(const GreyImage& image) {
  GreyImage result = image;
  const auto width = static_cast<std::ptrdiff_t>(image.width_px);
  for (std::ptrdiff_t y = 0; y < image.height_px; ++y) {
    std::reverse(result.bytes.begin() + y * width, result.bytes.begin() + (y + 1) * width);
    if (!result.levels.empty())
      std::reverse(result.levels.begin() + y * width, result.levels.begin() + (y + 1) * width);
  }
  return result;
}

/// Measurements of the mirrored picture in the picture itself.
void mirror(FrameDetections& frame) {
  const double right = frame.width_px - 1;
  for (Detection& corner : frame.detections) {
    corner.centre_px.x() = right - corner.centre_px.x();
    corner.covariance_px2(0, 1) *= -1;
    corner.covariance_px2(1, 0) *= -1;
  }
  for (TagDetection& tag : frame.tags)
    tag.corners_px.row(0) = right - tag.corners_px.row(0).array();
  for (Rejection& rejection : frame.rejections)
    if (rejection.centre_px) rejection.centre_px->x() = right - rejection.centre_px->x();
}

/// The back of a two-sided board is the front's mirror image: each corner lies behind its like.
FrameDetections detect_tagged(const GreyImage& image, const Target& target) {
  FrameDetections frame = detect_face(image, target);
  if (!frame.tags.empty()) return frame;
  FrameDetections back = detect_face(mirrored(image), target);
  if (back.tags.size() < 2) return frame;
  mirror(back);
  return back;
}

}  // namespace

FrameDetections detect_board(const GreyImage& image, const Target& target) {
  if (target.kind == TargetKind::chessboard) return detect_chessboard(image, target);
  return detect_tagged(image, target);
}

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/geometry/homography.hpp"
#include "core/geometry/vectors.hpp"
#include "detect/dots/noise.hpp"
#include "detect/tags/tags.hpp"
#include "detect/targets/chessboard.hpp"
#include "detect/targets/corner.hpp"

namespace drape::detect {

namespace {

using Eigen::Vector2d;
using Corners = Eigen::Matrix<double, 2, 4>;

constexpr std::size_t kTagsPerMap = 4;
constexpr double kReachPitches = 1.6;

Corners turned(const Corners& corners, int quarters) {
  Corners result;
  for (int k = 0; k < 4; ++k) result.col(k) = corners.col((k + quarters) % 4);
  return result;
}

/// Homography of the corners of tags, each turned by the same number of quarters, from the target's
/// plane to pixels.
std::optional<Eigen::Matrix3d> map_of(const std::vector<Corners>& corners_m,
                                      const std::vector<Corners>& corners_px, int quarters) {
  std::vector<Vector2d> from, to;
  for (std::size_t i = 0; i < corners_m.size(); ++i) {
    const Corners px = turned(corners_px[i], quarters);
    for (int k = 0; k < 4; ++k) {
      from.emplace_back(corners_m[i].col(k));
      to.emplace_back(px.col(k));
    }
  }
  return projective_map(from, to);
}

/// Quarter turns by which the tags were printed: those with which one homography maps the corners
/// of all tags best. A single tag fits all four and counts as upright.
int quarters_turned(const std::vector<Corners>& corners_m, const std::vector<Corners>& corners_px) {
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int quarters = 0; corners_m.size() > 1 && quarters < 4; ++quarters) {
    const auto map = map_of(corners_m, corners_px, quarters);
    if (!map) continue;
    double sum = 0;
    for (std::size_t i = 0; i < corners_m.size(); ++i) {
      const Corners px = turned(corners_px[i], quarters);
      for (int k = 0; k < 4; ++k) sum += (mapped(*map, corners_m[i].col(k)) - px.col(k)).norm();
    }
    if (sum >= least) continue;
    least = sum;
    best = quarters;
  }
  return best;
}

Corners corners_in_plane(const Vector2d& centre_m, double edge_m) {
  const double half = edge_m / 2;
  Corners corners;
  corners << -half, half, half, -half, half, half, -half, -half;
  return corners.colwise() + centre_m;
}

/// Predicts the image of a tagged target's points from nearby tags.
class BoardMap {
 public:
  /// `tags` must belong to the target, each id once.
  BoardMap(const Target& target, const std::vector<TagDetection>& tags);

  /// Homography from the target's plane (metres) to pixels, fitted to the four nearest tags.
  /// nullopt if no tag lies within 1.6 pitches.
  [[nodiscard]] std::optional<Eigen::Matrix3d> around(const Eigen::Vector2d& point_m) const;

 private:
  struct SeenTag {
    Eigen::Vector2d centre_m;
    Eigen::Matrix<double, 2, 4> corners_m, corners_px;
  };
  double pitch_m_;
  std::vector<SeenTag> tags_;
};

BoardMap::BoardMap(const Target& target, const std::vector<TagDetection>& tags)
    : pitch_m_(target.pitch_m) {
  std::vector<Vector2d> centres_m;
  std::vector<Corners> corners_m, corners_px;
  for (const TagDetection& tag : tags) {
    const auto printed = std::find_if(target.tags.begin(), target.tags.end(),
                                      [&](const PrintedTag& t) { return t.id == tag.id; });
    centres_m.push_back(printed->centre_m);
    corners_m.push_back(corners_in_plane(printed->centre_m, target.tag_edge_m));
    corners_px.push_back(tag.corners_px);
  }
  const int quarters = quarters_turned(corners_m, corners_px);
  for (std::size_t i = 0; i < tags.size(); ++i)
    tags_.push_back({centres_m[i], corners_m[i], turned(corners_px[i], quarters)});
}

std::optional<Eigen::Matrix3d> BoardMap::around(const Vector2d& point_m) const {
  std::vector<const SeenTag*> nearest;
  const auto distance = [&](const SeenTag* tag) { return (tag->centre_m - point_m).norm(); };
  for (const SeenTag& tag : tags_) {
    if (distance(&tag) <= kReachPitches * pitch_m_) nearest.push_back(&tag);
  }
  if (nearest.empty()) return std::nullopt;
  std::stable_sort(nearest.begin(), nearest.end(),
                   [&](const SeenTag* a, const SeenTag* b) { return distance(a) < distance(b); });
  nearest.resize(std::min(nearest.size(), kTagsPerMap));
  std::vector<Corners> corners_m, corners_px;
  for (const SeenTag* tag : nearest) {
    corners_m.push_back(tag->corners_m);
    corners_px.push_back(tag->corners_px);
  }
  return map_of(corners_m, corners_px, 0);
}

constexpr double kEdge_px = 1;               ///< part of the free width taken by a blurred edge
constexpr double kMostPitchFraction = 0.25;  ///< largest half window, as for a chessboard
constexpr double kLeastContrastSigmas = 6;
constexpr int kMostGrowth_px = 3;

std::vector<TagDetection> tags_of(const GreyImage& image, const Target& target,
                                  double noise_sigma) {
  TagFinder finder(target.tag_family, {target.tag_border, 1, true});
  const PrintPlane plane = plane_of(target);
  std::map<int, TagDetection> known;
  for (const TagDetection& tag : finder.find(image, plane, noise_sigma)) known[tag.id] = tag;
  // The small squares of an AprilGrid touch the corners of its tags, so the library sees one shape;
  // dilating the light separates them.
  for (int by_px = 1; target.kind == TargetKind::aprilgrid && by_px <= kMostGrowth_px; ++by_px) {
    if (known.size() == target.tags.size()) break;
    for (TagDetection& tag : finder.find(with_light_grown(image, by_px), plane, noise_sigma)) {
      tag.corners_px = without_growth(tag.corners_px, by_px);
      known.try_emplace(tag.id, tag);
    }
  }
  std::vector<TagDetection> tags;
  for (const auto& [id, tag] : known) tags.push_back(tag);
  return tags;
}

}  // namespace

std::string other_border(const GreyImage& image, const Target& target, std::size_t found,
                         const std::string& file) {
  if (target.kind != TargetKind::aprilgrid || found >= target.tags.size()) return "";
  const double noise_sigma = estimate_noise(image).sigma(128);
  Target other = target;
  for (const int border : {1, 2}) {
    other.tag_border = border;
    if (border == target.tag_border) continue;
    const std::size_t count = tags_of(image, other, noise_sigma).size();
    if (count > found)
      return fmt::format(
          "{} of {} tags are read with a black border of {} modules, {} with one of {} as stated: "
          "give tags.border_modules = {} in {}",
          count, target.tags.size(), border, found, target.tag_border, border, file);
  }
  return "";
}

namespace {

/// Width around a corner that contains only its own edges: up to the tags of a ChArUco board; in an
/// AprilGrid up to the far side of the small squares or the inner edge of the border.
double free_width_m(const Target& target) {
  const double gap = target.pitch_m - target.tag_edge_m;
  if (target.kind == TargetKind::charuco)
    return std::min(gap / 2, kMostPitchFraction * target.pitch_m);
  const TagFamily family(target.tag_family, target.tag_border);
  return std::min(gap, target.tag_edge_m * target.tag_border / family.edge_modules());
}

/// Neighbourhood of one corner in the picture.
struct Surroundings {
  Vector2d px;
  double free_px = 0;     ///< distance to the nearest side of the free square's image
  Vector2d diagonals[4];  ///< centres of the four quadrants around it
};

Surroundings surroundings_of(const Eigen::Matrix3d& map, const Vector2d& point_m, double free_m) {
  Surroundings around{mapped(map, point_m), std::numeric_limits<double>::infinity(), {}};
  int k = 0;
  for (const Vector2d& diagonal :
       {Vector2d(1, 1), Vector2d(-1, 1), Vector2d(-1, -1), Vector2d(1, -1)}) {
    const Vector2d along(diagonal.x(), 0), across(0, diagonal.y());
    // Seen obliquely the free square is a parallelogram: its sides are closer than its arms' ends.
    const Vector2d a = mapped(map, point_m + free_m * along) - around.px;
    const Vector2d b = mapped(map, point_m + free_m * across) - around.px;
    const double area = std::abs(cross(a, b));
    around.free_px = std::min(around.free_px, area / std::max(a.norm(), b.norm()));
    around.diagonals[k++] = mapped(map, point_m + 0.6 * free_m * diagonal);
  }
  return around;
}

/// Grey-level difference of the two pairs of opposite quadrants; nullopt at the image's border.
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

/// Measures the corners of one frame one by one.
class CornerReader {
 public:
  CornerReader(const GreyImage& image, double free_m, double noise_sigma, FrameDetections& frame)
      : image_(image), free_m_(free_m), noise_sigma_(noise_sigma), frame_(frame) {}

  void read(MarkId mark, const Vector2d& point_m, const Eigen::Matrix3d& map) {
    const Surroundings around = surroundings_of(map, point_m, free_m_);
    const std::optional<double> contrast = contrast_at(image_, around);
    if (!contrast) return;  // Outside the picture, where nothing could be found.
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
  const double noise_sigma = estimate_noise(image).sigma(128);
  frame.noise_sigma = noise_sigma;
  frame.tags = tags_of(image, target, noise_sigma);
  if (frame.tags.empty()) return frame;
  const BoardMap board(target, frame.tags);
  CornerReader reader(image, free_width_m(target), noise_sigma, frame);
  for (int row = 0; row < target.rows; ++row) {
    for (int col = 0; col < target.cols; ++col) {
      const Vector2d point_m = target.point_in_target({row, col}).head<2>();
      if (const auto map = board.around(point_m)) reader.read({row, col}, point_m, *map);
    }
  }
  set_corner_covariances(target, reader.points, frame);
  return frame;
}

/// Converts measurements in the mirrored picture to the original one.
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

/// Handles two-sided boards: the back mirrors the front, so each corner lies behind its equal.
FrameDetections detect_tagged(const GreyImage& image, const Target& target) {
  FrameDetections frame = detect_face(image, target);
  if (!frame.tags.empty()) return frame;
  FrameDetections back = detect_face(mirrored(image), target);
  if (back.tags.size() < 2) return frame;
  mirror(back);
  return back;
}

}  // namespace

GreyImage with_light_grown(const GreyImage& image, int by_px) {
  GreyImage grown{image.width_px, image.height_px, image.bytes, {}};
  cv::Mat to = view_of(grown);
  const int side = 2 * by_px + 1;
  cv::dilate(view_of(image), to, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  return grown;
}

Eigen::Matrix<double, 2, 4> without_growth(const Eigen::Matrix<double, 2, 4>& corners_px,
                                           int by_px) {
  const Eigen::Vector2d middle = corners_px.rowwise().mean();
  Eigen::Matrix<double, 3, 4> lines;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector2d a = corners_px.col(k), along = corners_px.col((k + 1) % 4) - a;
    Eigen::Vector2d outwards = Eigen::Vector2d(along.y(), -along.x()).normalized();
    if (outwards.dot(a - middle) < 0) outwards = -outwards;
    lines.col(k) << outwards, -outwards.dot(a) - by_px * outwards.lpNorm<1>();
  }
  Eigen::Matrix<double, 2, 4> corners;
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d before = lines.col((k + 3) % 4), after = lines.col(k);
    corners.col(k) = before.cross(after).hnormalized();
  }
  return corners;
}

FrameDetections detect_board(const GreyImage& image, const Target& target) {
  if (target.kind == TargetKind::chessboard) return detect_chessboard(image, target);
  return detect_tagged(image, target);
}

}  // namespace drape::detect

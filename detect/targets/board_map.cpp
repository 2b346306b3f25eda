// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board_map.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <opencv2/calib3d.hpp>

namespace drape::detect {
namespace {

using Eigen::Vector2d;
using Corners = Eigen::Matrix<double, 2, 4>;

constexpr std::size_t kTagsPerMap = 4;
constexpr double kReachPitches = 1.6;

std::optional<Eigen::Matrix3d> projective_map(const std::vector<Vector2d>& from,
                                              const std::vector<Vector2d>& to) {
  std::vector<cv::Point2d> source, target;
  for (std::size_t i = 0; i < from.size(); ++i) {
    source.emplace_back(from[i].x(), from[i].y());
    target.emplace_back(to[i].x(), to[i].y());
  }
  const cv::Mat found = cv::findHomography(source, target, 0);
  if (found.empty()) return std::nullopt;
  Eigen::Matrix3d map;
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col) map(row, col) = found.at<double>(row, col);
  return map;
}

Vector2d centre_of(const Corners& corners) {
  // The diagonals cross where the tag's centre is, under any perspective.
  const auto line = [&](int a, int b) -> Eigen::Vector3d {
    return corners.col(a).homogeneous().cross(corners.col(b).homogeneous());
  };
  return line(0, 2).cross(line(1, 3)).hnormalized();
}

Corners turned(const Corners& corners, int quarters) {
  Corners result;
  for (int k = 0; k < 4; ++k) result.col(k) = corners.col((k + quarters) % 4);
  return result;
}

/// How many quarters the tags were printed turned by: their centres alone tell where each corner
/// must be. Upright for fewer than four tags or tags on one line.
int quarters_turned(const std::vector<Vector2d>& centres_m, const std::vector<Corners>& corners_m,
                    const std::vector<Corners>& corners_px) {
  if (centres_m.size() < 4) return 0;
  std::vector<Vector2d> centres_px;
  centres_px.reserve(corners_px.size());
  for (const Corners& corners : corners_px) centres_px.push_back(centre_of(corners));
  const auto map = projective_map(centres_m, centres_px);
  if (!map) return 0;
  int best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (int quarters = 0; quarters < 4; ++quarters) {
    double sum = 0;
    for (std::size_t i = 0; i < corners_m.size(); ++i) {
      const Corners px = turned(corners_px[i], quarters);
      for (int k = 0; k < 4; ++k) {
        const Vector2d expected = (*map * corners_m[i].col(k).homogeneous()).hnormalized();
        sum += (expected - px.col(k)).norm();
      }
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

}  // namespace

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
  const int quarters = quarters_turned(centres_m, corners_m, corners_px);
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
  std::vector<Vector2d> from, to;
  for (const SeenTag* tag : nearest) {
    for (int k = 0; k < 4; ++k) {
      from.emplace_back(tag->corners_m.col(k));
      to.emplace_back(tag->corners_px.col(k));
    }
  }
  return projective_map(from, to);
}

}  // namespace drape::detect

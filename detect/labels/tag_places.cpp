// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/tag_places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace drape::detect {
namespace {

constexpr double kNearer = 1.2;         ///< what lies between two tags, than any tag, at most
constexpr double kTurned_cos = 0.5;     ///< 60 degrees
constexpr std::size_t kLeastTags = 2;   ///< that contradict the others: one may be misread
constexpr std::size_t kLeastPart = 10;  ///< and of so many tags one

struct TagMap {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_m;     ///< of the print's plane
  double largest_px_per_m = 0;  ///< along edges and diagonals
};

TagMap map_of(const PrintPlane& plane, const TagDetection& tag) {
  const auto& c = tag.corners_px;
  TagMap map;
  map.centre_px = c.rowwise().mean();
  const double edge_m = plane.tag_edge_m;
  map.px_per_m.col(0) = (c.col(1) - c.col(0) + c.col(2) - c.col(3)) / (2 * edge_m);
  map.px_per_m.col(1) = plane.row_sign * (c.col(3) - c.col(0) + c.col(2) - c.col(1)) / (2 * edge_m);
  for (int k = 0; k < 4; ++k)
    map.largest_px_per_m =
        std::max(map.largest_px_per_m, (c.col((k + 1) % 4) - c.col(k)).norm() / edge_m);
  for (int k = 0; k < 2; ++k)
    map.largest_px_per_m = std::max(map.largest_px_per_m,
                                    (c.col(k + 2) - c.col(k)).norm() / (std::sqrt(2.0) * edge_m));
  return map;
}

}  // namespace

std::string tags_elsewhere(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                           const std::string& file) {
  constexpr double kMm = 1000;
  const char* keys = plane.stiff ? "tags.tag.centre_mm" : "tags.first_id, tags.cells";
  std::vector<TagMap> maps;
  double px_per_m = 0;
  for (const TagDetection& tag : tags) {
    maps.push_back(map_of(plane, tag));
    px_per_m = std::max(px_per_m, maps.back().largest_px_per_m);
  }
  const std::size_t count = tags.size();
  std::vector<std::vector<char>> apart(count, std::vector<char>(count, 0));
  double largest = 0;
  std::size_t pairs = 0, turned = 0;
  std::string example;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < count; ++k) {
      if (i == k) continue;
      const Eigen::Vector2d step_m = plane.tags.at(tags[k].id) - plane.tags.at(tags[i].id);
      const Eigen::Vector2d step_px = maps[k].centre_px - maps[i].centre_px;
      const Eigen::Vector2d expected_px = maps[i].px_per_m * step_m;
      ++pairs;
      if (expected_px.dot(step_px) < kTurned_cos * expected_px.norm() * step_px.norm()) ++turned;
      const double seen_m = step_px.norm() / px_per_m;
      if (seen_m <= kNearer * step_m.norm()) continue;
      apart[i][k] = 1;
      if (seen_m <= largest * step_m.norm()) continue;
      largest = seen_m / step_m.norm();
      example =
          fmt::format("tags {} and {} lie {:.0f} mm apart at least, {} has them {:.0f} mm apart",
                      tags[i].id, tags[k].id, kMm * seen_m, file, kMm * step_m.norm());
    }
  // Without the one that contradicts most, until none does: so many are where they must not be.
  std::size_t out = 0;
  for (;; ++out) {
    std::size_t worst = 0;
    std::ptrdiff_t most = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (const auto found = std::count(apart[i].begin(), apart[i].end(), 1); found > most) {
        most = found;
        worst = i;
      }
    if (most == 0) break;
    for (std::size_t i = 0; i < count; ++i) apart[i][worst] = apart[worst][i] = 0;
  }
  if (out >= kLeastTags && kLeastPart * out >= count)
    return fmt::format("{} of {} tags lie elsewhere on the print: {} ({})", out, count, example,
                       keys);
  // A plate shows all of them in the same direction, a cloth in folds most.
  const std::size_t part = plane.stiff ? kLeastPart : 2;
  if (count > kLeastTags && part * turned > pairs)
    return fmt::format(
        "its tags lie in other directions from each other than {} has them: are rows and columns, "
        "or the sign of an axis, exchanged ({})?",
        file, keys);
  return {};
}

}  // namespace drape::detect

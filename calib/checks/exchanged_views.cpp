// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/exchanged_views.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/joint/alone.hpp"
#include "calib/joint/planar_view.hpp"
#include "calib/joint/start.hpp"

namespace drape::calib {
namespace {

using Eigen::Vector2d;

using Points = std::vector<TargetPoint>;

/// RMS distance of the second camera's points from where the first one's view of the target has
/// them, as a part of their image's size.
double contradiction(const Camera& first, const Points& by_first, const Camera& second,
                     const Points& by_second) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const auto homography = homography_of(without_lens(first.model, by_first));
  if (!homography || by_second.empty()) return kNone;
  const WorldFromTarget placed = first.cam_from_world.inverse() *
                                 planar_pose(*homography, 1, Vector2d::Zero()).cam_from_target;
  Vector2d low = by_second.front().measured_px, high = low;
  double sum = 0;
  for (const TargetPoint& point : by_second) {
    const auto image =
        project(second.model, second.cam_from_world * (placed * point.point_in_target));
    if (!image) return kNone;
    sum += (image->px - point.measured_px).squaredNorm();
    low = low.cwiseMin(point.measured_px);
    high = high.cwiseMax(point.measured_px);
  }
  return std::sqrt(sum / static_cast<double>(by_second.size())) / (high - low).norm();
}

/// Views of one set by camera, null where a camera has none.
using Views = std::vector<const Points*>;

Views views_of(const JointModel& all, std::size_t placement) {
  Views views(all.cameras.size(), nullptr);
  for (const JointFrame& frame : all.frames)
    if (frame.placement == placement) views[frame.camera] = &frame.points;
  return views;
}

/// Distance of the worst of the views from the one that agrees best with all others. All of them:
/// two cameras on opposite sides that are exchanged see a target that is turned, which only a third
/// one contradicts.
double contradiction(const JointModel& started, const Views& views) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t source = 0; source < views.size(); ++source) {
    if (views[source] == nullptr) continue;
    double worst = 0;
    for (std::size_t c = 0; c < views.size(); ++c) {
      if (c == source || views[c] == nullptr) continue;
      worst = std::max(worst, contradiction(started.cameras[source].camera, *views[source],
                                            started.cameras[c].camera, *views[c]));
    }
    least = std::min(least, worst);
  }
  return least;
}

}  // namespace

std::string exchanged_views(const JointModel& all, const JointModel& started) {
  for (std::size_t a = 0; a < started.cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < started.cameras.size(); ++b) {
      std::vector<std::string> sets;
      for (std::size_t p = 0; p < all.placements.size(); ++p) {
        Views views = views_of(all, p);
        if (views[a] == nullptr || views[b] == nullptr) continue;
        const double as_named = contradiction(started, views);
        if (as_named < contradicting_part) continue;
        std::swap(views[a], views[b]);
        const double exchanged = contradiction(started, views);
        // The better one of two bad explanations is none: a quarter, as for a camera that is odd.
        if (exchanged < contradicting_part && exchanged < as_named / 4)
          sets.push_back(all.placements[p].set);
      }
      if (sets.empty()) continue;
      return fmt::format(
          "{} and {} are exchanged in {} against the other sets: give each camera one name in all "
          "sets, then detect again",
          started.cameras[a].camera.name, started.cameras[b].camera.name, fmt::join(sets, ", "));
    }
  }
  return {};
}

}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
#include "calib/checks/exchanged_views.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "calib/joint/alone.hpp"
#include "calib/joint/planar_view.hpp"
#include "calib/joint/start.hpp"
#include "core/rules.hpp"

namespace drape::calib {
namespace {

using Eigen::Vector2d;

using Points = std::vector<TargetPoint>;

/// Views of one set, indexed by camera; null for a camera without
/// one.
using Views = std::vector<const Points*>;

/// Agreement of the views of one set, assuming that cameras may have been named
/// wrongly.
class SetOfViews {
 public:
  SetOfViews(const JointModel& started, std::string name, Views views)
      : name_(std::move(name)),
        views_(std::move(views)),
        started_(&started),
        placed_(views_.size() * views_.size()) {}

  [[nodiscard]] bool has(std::size_t camera) const { return views_[camera] != nullptr; }

  /// Distance of the worst view from the one that agrees best with all others, relative to the
  /// image size, with the views of cameras `a` and `b` exchanged; infinite from `limit` on. All
  /// views matter: two exchanged cameras on opposite sides see a rotated target, which only a third
  /// camera contradicts.
  double contradiction(std::size_t a, std::size_t b, double limit) {
    const auto taken_by = [&](std::size_t camera) {
      return camera == a ? b : camera == b ? a : camera;
    };
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t source = 0; source < views_.size(); ++source) {
      if (views_[taken_by(source)] == nullptr) continue;
      double worst = 0;
      for (std::size_t c = 0; c < views_.size() && worst < std::min(least, limit); ++c)
        if (c != source && views_[taken_by(c)] != nullptr)
          worst = std::max(worst, distance(source, taken_by(source), c, taken_by(c)));
      if (worst < limit) least = std::min(least, worst);
    }
    return least;
  }

  /// Name of the set.
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  /// Position of the target according to one camera's view of it, computed once.
  const std::optional<WorldFromTarget>& place_by(std::size_t camera, std::size_t view) {
    auto& place = placed_[camera * views_.size() + view];
    if (!place) {
      place.emplace();
      const Camera& by = started_->cameras[camera].camera;
      if (const auto homography = homography_of(without_lens(by.model, *views_[view])))
        *place = by.cam_from_world.inverse() *
                 planar_pose(*homography, 1, Vector2d::Zero()).cam_from_target;
    }
    return *place;
  }

  /// RMS distance of the second camera's points from the positions predicted by the first one's
  /// view of the target, relative to the size of their image.
  double distance(std::size_t first, std::size_t first_view, std::size_t second,
                  std::size_t second_view) {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const Points& points = *views_[second_view];
    const auto& placed = place_by(first, first_view);
    if (!placed || points.empty()) return kNone;
    const Camera& camera = started_->cameras[second].camera;
    Vector2d low = points.front().measured_px, high = low;
    double sum = 0;
    for (const TargetPoint& point : points) {
      const auto image =
          project(camera.model, camera.cam_from_world * (*placed * point.point_in_target));
      if (!image) return kNone;
      sum += (image->px - point.measured_px).squaredNorm();
      low = low.cwiseMin(point.measured_px);
      high = high.cwiseMax(point.measured_px);
    }
    return std::sqrt(sum / static_cast<double>(points.size())) / (high - low).norm();
  }

  std::string name_;
  Views views_;
  const JointModel* started_;
  std::vector<std::optional<std::optional<WorldFromTarget>>> placed_;
};

/// A set whose views contradict each other, with the size of the contradiction.
struct Contradiction {
  SetOfViews set;
  double as_named;
};

/// Sets whose views, as named, contradict each other: a good calibration has none, and the cost per
/// set is quadratic in the number of cameras.
std::vector<Contradiction> contradictions(const JointModel& all, const JointModel& started) {
  std::vector<Views> by_set(all.placements.size(), Views(all.cameras.size(), nullptr));
  for (const JointFrame& frame : all.frames) by_set[frame.placement][frame.camera] = &frame.points;
  std::vector<Contradiction> found;
  for (std::size_t p = 0; p < by_set.size(); ++p) {
    SetOfViews set(started, all.placements[p].set, std::move(by_set[p]));
    const double as_named = set.contradiction(0, 0, std::numeric_limits<double>::infinity());
    if (as_named >= contradicting_part) found.push_back({std::move(set), as_named});
  }
  return found;
}

}  // namespace

std::string exchanged_views(const JointModel& all, const JointModel& started) {
  std::vector<Contradiction> bad = contradictions(all, started);
  for (std::size_t a = 0; a < started.cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < started.cameras.size(); ++b) {
      std::vector<std::string> sets;
      for (auto& [set, as_named] : bad) {
        if (!set.has(a) || !set.has(b)) continue;
        // The better of two bad explanations is none: require a factor of 4, as for an odd camera.
        const double limit = std::min(contradicting_part, as_named / 4);
        if (set.contradiction(a, b, limit) < limit) sets.push_back(set.name());
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

std::string unconfirmed_labels(const Target& target, const JointModel& all,
                               const JointModel& started) {
  if (!is_ambiguous(target)) return {};
  constexpr const char* kRemedy =
      "use a board of an odd number of rows and columns together, or one with tags";
  const auto turned = [&](Points points) {
    for (TargetPoint& point : points) {
      point.dot = {target.rows - 1 - point.dot.row, target.cols - 1 - point.dot.col};
      point.point_in_target = target.point_in_target(point.dot);
    }
    return points;
  };
  std::map<std::pair<std::size_t, std::size_t>, int> common;
  for (const JointFrame& a : all.frames)
    for (const JointFrame& b : all.frames) {
      if (a.placement != b.placement || a.camera >= b.camera) continue;
      const auto apart = [&](const Points& by_b) {
        Views views(started.cameras.size(), nullptr);
        views[a.camera] = &a.points, views[b.camera] = &by_b;
        return SetOfViews(started, {}, views)
            .contradiction(a.camera, a.camera, std::numeric_limits<double>::infinity());
      };
      if (apart(b.points) < contradicting_part) {
        ++common[{a.camera, b.camera}];
      } else if (apart(turned(b.points)) < contradicting_part) {
        return fmt::format(
            "the target looks the same after half a turn, and set {} is labelled otherwise by {} "
            "than by {}, which is rolled against it; {}",
            all.placements[a.placement].set, started.cameras[b.camera].camera.name,
            started.cameras[a.camera].camera.name, kRemedy);
      }
    }
  std::set<std::size_t> joined = {0};
  for (std::size_t before = 0; before < joined.size();) {
    before = joined.size();
    for (const auto& [pair, views] : common)
      if (views >= 2 && joined.contains(pair.first) != joined.contains(pair.second))
        joined.insert({pair.first, pair.second});
  }
  for (std::size_t c = 0; c < started.cameras.size(); ++c)
    if (!joined.contains(c))
      return fmt::format(
          "the place of {} rests on one view in common of a target that looks the same after half "
          "a turn: its labels are not confirmed; add views that both cameras see, or {}",
          started.cameras[c].camera.name, kRemedy);
  return {};
}

}  // namespace drape::calib

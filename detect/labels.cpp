// SPDX-License-Identifier: Apache-2.0
#include "detect/labels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <queue>
#include <tuple>

#include "detect/local_map.hpp"

namespace drape {
namespace {

// A correct step misses by the change of curvature along it: a few per cent on gentle cloth, up to
// a quarter of a step where a fold begins. A wrong dot misses by about one step.
constexpr double most_step_error = 0.22;
constexpr double clear_lead = 0.55;  // best miss over second best
constexpr double most_disagreement = 0.45;

constexpr std::array<MarkId, 4> neighbours = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};

/// A proposal that dot `dot` is mark `mark`.
struct Proposal {
  double error = 0;
  MarkId mark;
  std::size_t dot = 0;
  Eigen::Matrix2d px_per_m;
};

struct Later {
  bool operator()(const Proposal& a, const Proposal& b) const {
    return std::tie(a.error, a.mark, a.dot) > std::tie(b.error, b.mark, b.dot);
  }
};

class Labeller {
 public:
  Labeller(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots)
      : plane_(plane), dots_(dots), labels_(dots.size()) {}

  void seed(const std::vector<TagDetection>& tags) {
    for (const TagDetection& tag : tags) {
      const Eigen::Vector2d centre_m = plane_.tags.at(tag.id);
      const auto map = map_at_centre(plane_.tag_corners_m(tag.id), tag.corners_px, centre_m);
      if (!map || map->px_per_m.determinant() * plane_.row_sign <= 0) continue;
      tag_maps_.emplace_back(tag.id, *map);
      for (const MarkId mark : plane_.marks_around(tag.id)) {
        propose(*map, plane_.point_m(mark) - centre_m, mark);
      }
    }
  }

  void grow() {
    while (!queue_.empty()) {
      const Proposal next = queue_.top();
      queue_.pop();
      if (labels_[next.dot].mark || by_mark_.count(next.mark) != 0) continue;
      labels_[next.dot].mark = next.mark;
      by_mark_[next.mark] = next.dot;
      maps_[next.mark] = {dots_[next.dot].centre_px, next.px_per_m};
      if (!dots_[next.dot].sound) continue;
      for (const MarkId step : neighbours) {
        const MarkId mark{next.mark.row + step.row, next.mark.col + step.col};
        if (!plane_.contains(mark) || by_mark_.count(mark) != 0) continue;
        propose(maps_[next.mark], plane_.point_m(mark) - plane_.point_m(next.mark), mark);
      }
    }
  }

  std::vector<DotLabel> finish() {
    for (DotLabel& label : labels_) {
      if (!label.mark && label.reason.empty()) {
        label.reason = "no label: no tag or labelled neighbour leads to it";
      }
    }
    return labels_;
  }

 private:
  void propose(const LocalMap& from, const Eigen::Vector2d& step_m, MarkId mark) {
    Proposal best;
    double first = 1e9, second = 1e9;
    for (std::size_t k = 0; k < dots_.size(); ++k) {
      const LocalMap to =
          map_of_dot(dots_[k].centre_px, dots_[k].shape_px2, plane_.dot_radius_m, from.px_per_m);
      const double error = step_error(from, to, step_m);
      if (error < first) {
        second = first;
        first = error;
        best = {error, mark, k, to.px_per_m};
      } else {
        second = std::min(second, error);
      }
    }
    if (first <= most_step_error && first <= clear_lead * second) queue_.push(best);
  }

  const PrintPlane& plane_;
  const std::vector<UnlabelledDot>& dots_;
  std::vector<DotLabel> labels_;
  std::map<MarkId, std::size_t> by_mark_;
  std::map<MarkId, LocalMap> maps_;
  std::vector<std::pair<int, LocalMap>> tag_maps_;
  std::priority_queue<Proposal, std::vector<Proposal>, Later> queue_;
};

}  // namespace

std::vector<DotLabel> label_dots(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                                 const std::vector<UnlabelledDot>& dots, const DarkMap& map) {
  (void)map;
  Labeller labeller(plane, dots);
  labeller.seed(tags);
  labeller.grow();
  return labeller.finish();
}

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "detect/labels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>
#include <tuple>

#include "detect/local_map.hpp"

namespace drape {
namespace {

// A tag is printed to 40 to 80 per cent; a neighbouring cell seen askew may show a tag's rim.
constexpr double tag_print_share = 0.35;
constexpr double bare_print_share = 0.10;

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

struct CellVotes {
  int cells = 0;  ///< that the print has around the mark
  int sum = 0;
};

class Labeller {
 public:
  Labeller(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots, const DarkMap& map)
      : plane_(plane),
        dots_(dots),
        map_(map),
        steps_(dots, plane.dot_radius_m),
        labels_(dots.size()),
        taken_(dots.size(), 0) {}

  void seed(const std::vector<TagDetection>& tags) {
    for (const TagDetection& tag : tags) {
      const Eigen::Vector2d centre_m = plane_.tags.at(tag.id);
      const auto map = map_at_centre(plane_.tag_corners_m(tag.id), tag.corners_px, centre_m);
      if (!map || map->px_per_m.determinant() * plane_.row_sign <= 0) continue;
      for (const MarkId mark : plane_.marks_around(tag.id)) {
        propose(*map, plane_.point_m(mark) - centre_m, mark);
      }
    }
  }

  /// Takes proposals, best first, until none is left; then asks all labelled dots again, since a
  /// rival that has found its own label no longer makes a step doubtful.
  void grow() {
    std::size_t before = 0;
    do {
      before = by_mark_.size();
      drain();
      for (const auto& [mark, dot] : std::map<MarkId, std::size_t>(by_mark_)) lead_on(mark);
      drain();
    } while (by_mark_.size() > before);
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
  void drain() {
    while (!queue_.empty()) {
      const Proposal next = queue_.top();
      queue_.pop();
      if (labels_[next.dot].mark || by_mark_.count(next.mark) != 0 || !credible(next)) continue;
      labels_[next.dot].mark = next.mark;
      taken_[next.dot] = 1;
      by_mark_[next.mark] = next.dot;
      maps_[next.mark] = {dots_[next.dot].centre_px, next.px_per_m};
      lead_on(next.mark);
    }
  }

  void lead_on(MarkId from) {
    for (const MarkId step : neighbours) {
      const MarkId mark{from.row + step.row, from.col + step.col};
      if (!plane_.contains(mark) || by_mark_.count(mark) != 0) continue;
      propose(maps_[from], plane_.point_m(mark) - plane_.point_m(from), mark);
    }
  }

  /// A step may miss by more the better the cells around the dot, and other labelled neighbours,
  /// speak for the label.
  bool credible(const Proposal& proposal) const {
    const auto& light = dots_[proposal.dot].light_centre;
    if (plane_.classes && light && *light != plane_.classes->is_light(proposal.mark)) return false;
    const CellVotes votes = cell_votes(proposal);
    const int sum = votes.sum + other_supporters(proposal);
    if (sum < 0) return false;
    const double support = std::min(1.0, sum / std::max(2.0, static_cast<double>(votes.cells)));
    return proposal.error <= blind_step_error + (most_step_error - blind_step_error) * support;
  }

  /// Labelled neighbours beyond the first from which the dot is one good step away.
  int other_supporters(const Proposal& proposal) const {
    int supporters = 0;
    for (const MarkId step : neighbours) {
      const auto from = maps_.find({proposal.mark.row + step.row, proposal.mark.col + step.col});
      if (from == maps_.end()) continue;
      const LocalMap to = steps_.map_at(proposal.dot, from->second);
      supporters += step_error(from->second, to,
                               plane_.point_m(proposal.mark) - plane_.point_m(from->first)) <=
                    most_step_error;
    }
    return std::max(0, supporters - 1);
  }

  void propose(const LocalMap& from, const Eigen::Vector2d& step_m, MarkId mark) {
    const BestStep best = steps_.best(from, step_m, taken_);
    if (best.is_clear()) queue_.push({best.error, mark, best.dot, best.to.px_per_m});
  }

  /// What the four cells around a dot say about a label: +1 for each that shows a tag (or none)
  /// as the print has it, -1 for each that contradicts.
  CellVotes cell_votes(const Proposal& proposal) const {
    CellVotes votes;
    for (const MarkId corner : {MarkId{-1, -1}, MarkId{-1, 0}, MarkId{0, -1}, MarkId{0, 0}}) {
      const MarkId cell{proposal.mark.row + corner.row, proposal.mark.col + corner.col};
      if (!plane_.contains(cell) || !plane_.contains({cell.row + 1, cell.col + 1})) continue;
      const Eigen::Vector2d centre_m = plane_.point_m(cell) +
                                       0.5 * plane_.pitch_m * Eigen::Vector2d::Ones() -
                                       plane_.point_m(proposal.mark);
      const double printed = printed_share(proposal, centre_m);
      ++votes.cells;
      const bool tag = plane_.has_tag_in_cell(cell);
      if (printed > tag_print_share) votes.sum += tag ? 1 : -1;
      if (printed < bare_print_share) votes.sum += tag ? -1 : 1;
    }
    return votes;
  }

  /// Share of printed pixels where a tag would be, seen from a dot through its local map.
  double printed_share(const Proposal& from, const Eigen::Vector2d& centre_m) const {
    constexpr int half = 3;
    int printed = 0;
    for (int y = -half; y <= half; ++y) {
      for (int x = -half; x <= half; ++x) {
        const Eigen::Vector2d at_m =
            centre_m + 0.4 * plane_.tag_edge_m / half * Eigen::Vector2d(x, y);
        const Eigen::Vector2d px = dots_[from.dot].centre_px + from.px_per_m * at_m;
        printed += map_.at(static_cast<int>(std::lround(px.x())),
                           static_cast<int>(std::lround(px.y()))) != 0;
      }
    }
    return printed / static_cast<double>((2 * half + 1) * (2 * half + 1));
  }

  const PrintPlane& plane_;
  const std::vector<UnlabelledDot>& dots_;
  const DarkMap& map_;
  DotSteps steps_;
  std::vector<DotLabel> labels_;
  std::vector<char> taken_;  ///< dots that have a label
  std::map<MarkId, std::size_t> by_mark_;
  std::map<MarkId, LocalMap> maps_;
  std::priority_queue<Proposal, std::vector<Proposal>, Later> queue_;
};

}  // namespace

std::vector<DotLabel> label_dots(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                                 const std::vector<UnlabelledDot>& dots, const DarkMap& map) {
  Labeller labeller(plane, dots, map);
  labeller.seed(tags);
  labeller.grow();
  return labeller.finish();
}

}  // namespace drape

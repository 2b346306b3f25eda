// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/labels.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "detect/labels/lattice.hpp"

namespace drape::detect {
namespace {

// Tags are black on 40 to 80 % of their area; an adjacent cell seen obliquely may show a tag's rim.
constexpr double tag_print_fraction = 0.35;
constexpr double bare_print_fraction = 0.10;

constexpr double contradicting_error = 0.15;  // error of a step to a contradicting mark, in steps
constexpr double most_flat_change = 0.12;     // change of the map along a step on flat cloth
constexpr double least_readable_px = 22;      // smallest tag that is readable, shorter direction

// Limits at the rim of the visible part; chosen on 25 drawn cloths in folds of 60 degrees and
// bench1.
constexpr int most_doubtful_votes = 0;   // votes among the four cells around a dot
constexpr double most_rim_error = 0.25;  // error of a step to a dot seen obliquely, in steps
constexpr double askew = 0.16;           // det / trace^2 of an ellipse with an axis ratio of 1 to 2

constexpr std::array<MarkId, 4> corners = {{{-1, -1}, {-1, 0}, {0, -1}, {0, 0}}};

struct CellVotes {
  int cells = 0;  ///< number of cells that the print has around the mark
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
        taken_(dots.size(), 0),
        certain_(dots.size(), 0) {}

  /// Labels dots from tags before any step from dot to dot: on a cloth folded flat onto itself, the
  /// column after the next may appear in place of the next one. A dot to which tags give different
  /// labels gets none.
  void seed(const std::vector<TagDetection>& tags) {
    std::vector<std::map<MarkId, int>> names(dots_.size());
    std::vector<DotProposal> proposals;
    for (const TagDetection& tag : tags) {
      const Eigen::Vector2d centre_m = plane_.tags.at(tag.id);
      const auto map = map_at_centre(plane_.tag_corners_m(tag.id), tag.corners_px, centre_m);
      if (!map || map->px_per_m.determinant() * plane_.row_sign <= 0) continue;
      const std::vector<MarkId> around = plane_.marks_around(tag.id);
      if (!around.empty()) read_cells_.insert(*std::min_element(around.begin(), around.end()));
      for (const MarkId mark : around) {
        const BestStep best = steps_.best(*map, plane_.point_m(mark) - centre_m, taken_);
        if (!best.is_clear()) continue;
        ++names[best.dot][mark];
        proposals.push_back({best.error, mark, best.dot, best.to});
      }
    }
    for (std::size_t dot = 0; dot < dots_.size(); ++dot) {
      if (names[dot].size() > 1) {
        taken_[dot] = 1;
        disputed_.push_back(dot);
        labels_[dot].reason = "no label: the tags beside it name it differently";
      }
      certain_[dot] = names[dot].size() == 1 && names[dot].begin()->second > 1;
    }
    for (const DotProposal& proposal : proposals) queue_.push(proposal);
    while (!queue_.empty()) (void)take_next();
  }

  /// Accepts proposals, best first, until none is left; then starts again from all labelled dots,
  /// since a rival that has obtained its own label no longer makes a step ambiguous.
  void grow() {
    std::size_t before = 0;
    do {
      before = by_mark_.size();
      drain();
      for (const auto& [mark, dot] : std::map<MarkId, std::size_t>(by_mark_)) lead_on(mark);
      drain();
    } while (by_mark_.size() > before);
  }

  /// Withdraws labels along flat folds: if two adjacent labelled dots are one step from two others
  /// that are not their neighbours, the correct side is unknown, so only dots with two agreeing
  /// tags keep their labels.
  std::vector<DotLabel> finish() {
    while (withdraw_at_rim()) {
    }
    std::map<MarkId, std::vector<MarkId>> seams;
    for (const auto& [mark, dot] : by_mark_) seams[mark] = contradictions(mark, maps_.at(mark));
    for (const auto& [mark, dot] : by_mark_) {
      if (certain_[dot] != 0 || seams.at(mark).empty()) continue;
      if (!runs_along(seams, mark) && !beside_disputed(mark)) continue;
      labels_[dot] = {std::nullopt, "no label: another mark stands where its neighbour must be"};
    }
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
      if (const auto mark = take_next()) lead_on(*mark);
    }
  }

  std::optional<MarkId> take_next() {
    const DotProposal next = queue_.top();
    queue_.pop();
    if (taken_[next.dot] != 0 || by_mark_.count(next.mark) != 0 || !credible(next)) {
      return std::nullopt;
    }
    labels_[next.dot].mark = next.mark;
    taken_[next.dot] = 1;
    by_mark_[next.mark] = next.dot;
    maps_[next.mark] = next.map;
    return next.mark;
  }

  void lead_on(MarkId from) {
    for (const MarkId step : neighbours) {
      const MarkId mark = from + step;
      if (!plane_.contains(mark) || by_mark_.count(mark) != 0) continue;
      const LocalMap& here = maps_[from];
      const BestStep best = steps_.best(here, plane_.point_m(mark) - plane_.point_m(from), taken_);
      if (!best.is_clear() || may_be_seam(from, mark, here, best.to)) continue;
      queue_.push({best.error, mark, best.dot, best.to});
    }
  }

  /// True if the step error is tolerable; tolerance grows with the support of the label by the
  /// cells around the dot and by other labelled neighbours.
  bool credible(const DotProposal& proposal) const {
    const auto& light = dots_[proposal.dot].light_centre;
    if (plane_.classes && light && *light != plane_.classes->is_light(proposal.mark)) return false;
    const CellVotes votes = cell_votes(proposal);
    const int sum = votes.sum + other_supporters(proposal) -
                    static_cast<int>(contradictions(proposal.mark, proposal.map).size());
    if (sum < 0) return false;
    const double support = std::min(1.0, sum / std::max(2.0, static_cast<double>(votes.cells)));
    return proposal.error <= step_tolerance(support);
  }

  /// Number of further labelled neighbours from which the dot is one valid step away.
  int other_supporters(const DotProposal& proposal) const {
    int supporters = 0;
    for (const MarkId step : neighbours) {
      const auto from = maps_.find(proposal.mark + step);
      if (from == maps_.end()) continue;
      const LocalMap to = steps_.map_at(proposal.dot, from->second);
      const Eigen::Vector2d step_m = plane_.point_m(proposal.mark) - plane_.point_m(from->first);
      supporters += step_error(from->second, to, step_m) <= most_step_error &&
                    !may_be_seam(from->first, proposal.mark, from->second, to);
    }
    return std::max(0, supporters - 1);
  }

  /// Labelled dots at the position of a neighbour that carry another mark.
  std::vector<MarkId> contradictions(MarkId mark, const LocalMap& here) const {
    const double reach = 1.5 * plane_.pitch_m * here.px_per_m.norm();
    std::vector<MarkId> found;
    for (const std::size_t dot : steps_.cells().within(here.centre_px, reach)) {
      const std::optional<MarkId>& other = labels_[dot].mark;
      if (!other) continue;
      for (const MarkId step : neighbours) {
        const MarkId expected = mark + step;
        if (*other == mark || *other == expected) continue;
        const Eigen::Vector2d step_m = plane_.point_m(expected) - plane_.point_m(mark);
        if (step_error(here, maps_.at(*other), step_m) <= contradicting_error)
          found.push_back(*other);
      }
    }
    return found;
  }

  /// Withdraws isolated labels; true if there were any.
  bool withdraw_at_rim() {
    std::vector<MarkId> alone;
    for (const auto& [mark, dot] : by_mark_)
      if (stands_alone(mark, dot)) alone.push_back(mark);
    for (const MarkId mark : alone) {
      labels_[by_mark_.at(mark)] = {
          std::nullopt, "no label: at the rim of what is seen, and little around it speaks for it"};
      by_mark_.erase(mark);
      maps_.erase(mark);
    }
    return !alone.empty();
  }

  /// Detects a corner of cloth that shows from behind a fold and matches the lattice by chance. The
  /// dot lies at the rim of the visible part but not of the print, no tag was read beside it, and
  /// it has one labelled neighbour, or no support by the cells around it, or is seen at more than
  /// 60 degrees with a poor step from a neighbour.
  bool stands_alone(MarkId mark, std::size_t dot) const {
    if (mark.row == 0 || mark.col == 0 || mark.row == plane_.rows - 1 ||
        mark.col == plane_.cols - 1) {
      return false;
    }
    for (const MarkId corner : corners) {
      if (read_cells_.count(mark + corner) != 0) return false;
    }
    int around = 0;
    double worst = 0;
    for (const MarkId step : neighbours) {
      const auto from = maps_.find(mark + step);
      if (from == maps_.end()) continue;
      ++around;
      const Eigen::Vector2d step_m = plane_.point_m(mark) - plane_.point_m(from->first);
      worst = std::max(worst, step_error(from->second, steps_.map_at(dot, from->second), step_m));
    }
    if (around == static_cast<int>(neighbours.size())) return false;
    if (around < 2) return true;
    const CellVotes votes = cell_votes({0, mark, dot, maps_.at(mark)});
    if (votes.sum <= most_doubtful_votes) return true;
    const Eigen::Matrix2d& shape = dots_[dot].shape_px2;
    const bool is_askew = shape.determinant() < askew * shape.trace() * shape.trace();
    return is_askew && worst > most_rim_error;
  }

  /// True if a neighbour of the mark is contradicted too, by a neighbour of its contradicting mark.
  static bool runs_along(const std::map<MarkId, std::vector<MarkId>>& seams, MarkId mark) {
    for (const MarkId other : seams.at(mark)) {
      for (const MarkId step : neighbours) {
        const auto beside = seams.find(mark + step);
        if (beside == seams.end()) continue;
        const auto& there = beside->second;
        if (std::find(there.begin(), there.end(), other + step) != there.end()) return true;
      }
    }
    return false;
  }

  /// True if a dot with conflicting tags is one step away.
  bool beside_disputed(MarkId mark) const {
    const LocalMap& here = maps_.at(mark);
    for (const std::size_t dot : disputed_) {
      const LocalMap there = steps_.map_at(dot, here);
      for (const MarkId step : neighbours) {
        const Eigen::Vector2d step_m = plane_.point_m(mark + step) - plane_.point_m(mark);
        if (step_error(here, there, step_m) <= contradicting_error) return true;
      }
    }
    return false;
  }

  /// True if two layers may meet here: a step along flat cloth beside the place of a tag that is
  /// large enough to read, where something is printed but no tag was read.
  bool may_be_seam(MarkId from, MarkId to, const LocalMap& at, const LocalMap& there) const {
    const double size = at.px_per_m.norm();
    if ((at.px_per_m - there.px_per_m).norm() > most_flat_change * size) return false;
    const double least_px_per_m = std::abs(at.px_per_m.determinant()) / size;
    if (least_px_per_m * plane_.tag_edge_m < least_readable_px) return false;
    const MarkId first = std::min(from, to);
    for (const MarkId beside : {MarkId{0, 0}, from.row == to.row ? MarkId{-1, 0} : MarkId{0, -1}}) {
      const MarkId cell = first + beside;
      if (!plane_.has_tag_in_cell(cell) || read_cells_.count(cell) != 0) continue;
      const Eigen::Vector2d centre_m = plane_.cell_centre_m(cell) - plane_.point_m(from);
      if (printed_fraction(at, centre_m) > bare_print_fraction) return true;
    }
    return false;
  }

  /// Votes of the four cells around a dot on a label: +1 for each that shows a tag, or none, as on
  /// the print, -1 for each that does not.
  CellVotes cell_votes(const DotProposal& proposal) const {
    CellVotes votes;
    for (const MarkId corner : corners) {
      const MarkId cell = proposal.mark + corner;
      if (!plane_.contains(cell) || !plane_.contains(cell + MarkId{1, 1})) continue;
      const Eigen::Vector2d centre_m = plane_.cell_centre_m(cell) - plane_.point_m(proposal.mark);
      const double printed = printed_fraction(proposal.map, centre_m);
      ++votes.cells;
      const bool tag = plane_.has_tag_in_cell(cell);
      if (printed > tag_print_fraction) votes.sum += tag ? 1 : -1;
      if (printed < bare_print_fraction) votes.sum += tag ? -1 : 1;
    }
    return votes;
  }

  /// Fraction of printed pixels at the place of a tag, predicted by the local map of a dot.
  double printed_fraction(const LocalMap& from, const Eigen::Vector2d& centre_m) const {
    constexpr int half = 3;
    int printed = 0;
    for (int y = -half; y <= half; ++y) {
      for (int x = -half; x <= half; ++x) {
        const Eigen::Vector2d at_m =
            centre_m + 0.4 * plane_.tag_edge_m / half * Eigen::Vector2d(x, y);
        const Eigen::Vector2d px = from.centre_px + from.px_per_m * at_m;
        printed += map_.at(static_cast<int>(std::floor(px.x() + 0.5)),
                           static_cast<int>(std::floor(px.y() + 0.5))) != 0;
      }
    }
    return printed / static_cast<double>((2 * half + 1) * (2 * half + 1));
  }

  const PrintPlane& plane_;
  const std::vector<UnlabelledDot>& dots_;
  const DarkMap& map_;
  DotSteps steps_;
  std::vector<DotLabel> labels_;
  std::vector<char> taken_;  ///< dots that have a label or must not get one
  std::set<MarkId> read_cells_;
  std::vector<std::size_t> disputed_;  ///< dots with conflicting tags
  std::vector<char> certain_;          ///< dots with two agreeing tags
  std::map<MarkId, std::size_t> by_mark_;
  std::map<MarkId, LocalMap> maps_;
  DotProposals queue_;
};

}  // namespace

std::vector<DotLabel> label_dots(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                                 const std::vector<UnlabelledDot>& dots, const DarkMap& map) {
  Labeller labeller(plane, dots, map);
  labeller.seed(tags);
  labeller.grow();
  return labeller.finish();
}

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/labels.hpp"

#include <Eigen/LU>
#include <cmath>
#include <queue>
#include <set>
#include <tuple>

#include "core/geometry/vectors.hpp"

namespace drape::detect {
namespace {

/// Offsets from a mark to its four neighbours.
constexpr std::array<MarkId, 4> neighbours = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};

/// Proposal that a dot is a certain mark of the print, or has a certain position in a piece of it.
struct DotProposal {
  double error = 0;  ///< error of the step that proposes it
  MarkId mark;
  std::size_t dot = 0;
  LocalMap map;
};
struct LaterProposal {
  bool operator()(const DotProposal& a, const DotProposal& b) const {
    return std::tie(a.error, a.mark, a.dot) > std::tie(b.error, b.mark, b.dot);
  }
};
/// Proposals in ascending order of error.
using DotProposals = std::priority_queue<DotProposal, std::vector<DotProposal>, LaterProposal>;

constexpr double nearest_in_pitches = 0.6;  // least distance of a neighbour in the dot's own map
constexpr double farthest_in_pitches = 1.4;
constexpr int least_directions = 3;  // directions in which a start needs a clear neighbour
constexpr std::size_t least_piece = 4;
constexpr double most_flat_miss = 0.2;  // in pitches
constexpr double most_area_ratio = 1.6;
constexpr std::size_t least_flat_dots = 8;

struct Start {
  int directions = 0;
  double error = 0;  ///< mean over those directions
  std::size_t dot = 0;
  Eigen::Matrix2d px_per_m;
};

/// Range of rows and columns of a piece.
struct Extent {
  MarkId first, last;
  [[nodiscard]] int rows() const { return last.row - first.row + 1; }
  [[nodiscard]] int cols() const { return last.col - first.col + 1; }
  [[nodiscard]] Extent with(MarkId place) const {
    return {{std::min(first.row, place.row), std::min(first.col, place.col)},
            {std::max(last.row, place.row), std::max(last.col, place.col)}};
  }
};

Extent extent_of(const LatticePiece& piece) {
  Extent extent{piece.begin()->first, piece.begin()->first};
  for (const auto& [place, dot] : piece) extent = extent.with(place);
  return extent;
}

/// True if a piece fits on the print in some orientation.
bool fits_print(const PrintPlane& plane, const Extent& extent) {
  const auto [shorter, longer] = std::minmax({extent.rows(), extent.cols()});
  return shorter <= std::min(plane.rows, plane.cols) && longer <= std::max(plane.rows, plane.cols);
}

/// Square lattice that contains the dots of a print: for a staggered one, along its diagonals.
PrintPlane grown_plane(PrintPlane plane) {
  if (!plane.staggered) return plane;
  plane.pitch_m *= std::sqrt(2.0);
  plane.rows = plane.cols = (plane.rows + plane.cols + 1) / 2;
  return plane;
}

/// The piece shifted so that its first row and column are 0.
LatticePiece from_zero(const LatticePiece& piece) {
  LatticePiece shifted;
  const MarkId first = extent_of(piece).first;
  for (const auto& [place, dot] : piece) shifted[place - first] = dot;
  return shifted;
}

/// The piece in rows and columns of the print, up to a shift and quarter turns.
LatticePiece along_rows(const PrintPlane& plane, const LatticePiece& piece) {
  if (!plane.staggered) return piece;
  LatticePiece turned;
  for (const auto& [place, dot] : piece)
    turned[{place.row + place.col, place.col - place.row}] = dot;
  return from_zero(turned);
}

/// The piece after a quarter turn: its columns to the right become rows downwards.
LatticePiece quarter_turn(const LatticePiece& piece) {
  const int last_row = extent_of(piece).last.row;
  LatticePiece turned;
  for (const auto& [place, dot] : piece) turned[{place.col, last_row - place.row}] = dot;
  return turned;
}

/// Gives dots their marks, or their positions in a piece, by steps from dot to dot.
class Grower {
 public:
  virtual ~Grower() = default;

  /// Accepts proposals, best first, until none is left; then starts again from all placed dots,
  /// since a rival that has obtained its own position no longer makes a step ambiguous.
  void grow() {
    std::size_t before = 0;
    do {
      before = placed_.size();
      drain();
      for (const auto& [mark, dot] : LatticePiece(placed_)) lead_on(mark);
      drain();
    } while (placed_.size() > before);
  }

 protected:
  Grower(PrintPlane plane, const std::vector<UnlabelledDot>& dots, std::vector<char> taken)
      : plane_(std::move(plane)),
        dots_(dots),
        steps_(dots, plane_.dot_radius_m),
        taken_(std::move(taken)),
        labels_(dots.size()) {}

  [[nodiscard]] virtual Eigen::Vector2d step_m(MarkId from, MarkId to) const = 0;
  [[nodiscard]] virtual bool is_credible(const DotProposal& proposal) const = 0;
  /// True if dots that are placed by a proposal lead to their neighbours.
  [[nodiscard]] virtual bool leads_on(std::size_t dot) const = 0;
  [[nodiscard]] virtual bool may_step(MarkId from, MarkId to, const LocalMap& there) const = 0;

  /// Places the dot of the best proposal, if that is credible.
  std::optional<MarkId> take_next() {
    const DotProposal next = queue_.top();
    queue_.pop();
    if (taken_[next.dot] != 0 || placed_.contains(next.mark) || !is_credible(next))
      return std::nullopt;
    labels_[next.dot].mark = next.mark;
    taken_[next.dot] = 1;
    placed_[next.mark] = next.dot;
    maps_[next.mark] = next.map;
    return next.mark;
  }

  const PrintPlane plane_;
  const std::vector<UnlabelledDot>& dots_;
  DotSteps steps_;
  std::vector<char> taken_;  ///< dots that have a position or must not get one
  std::vector<DotLabel> labels_;
  LatticePiece placed_;
  std::map<MarkId, LocalMap> maps_;  ///< of the placed dots
  DotProposals queue_;

 private:
  void drain() {
    while (!queue_.empty())
      if (const auto mark = take_next(); mark && leads_on(placed_.at(*mark))) lead_on(*mark);
  }

  void lead_on(MarkId from) {
    for (const MarkId step : neighbours) {
      const MarkId mark = from + step;
      if (placed_.contains(mark)) continue;
      const BestStep best = steps_.best(maps_.at(from), step_m(from, mark), taken_);
      if (best.is_clear() && may_step(from, mark, best.to))
        queue_.push({best.error, mark, best.dot, best.to});
    }
  }
};

class PieceGrower : public Grower {
 public:
  PieceGrower(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
              const std::vector<char>& taken)
      : Grower(grown_plane(plane), dots, taken) {}

  std::vector<LatticePiece> grow_all() {
    std::vector<Start> starts;
    for (std::size_t k = 0; k < dots_.size(); ++k) {
      if (taken_[k] != 0 || !dots_[k].sound) continue;
      if (const auto start = start_at(k)) starts.push_back(*start);
    }
    std::ranges::stable_sort(starts, [](const Start& a, const Start& b) {
      return a.directions != b.directions ? a.directions > b.directions : a.error < b.error;
    });
    std::vector<LatticePiece> pieces;
    for (const Start& start : starts) {
      if (taken_[start.dot] != 0) continue;
      LatticePiece piece = grown(start);
      if (piece.size() >= least_piece) pieces.push_back(std::move(piece));
    }
    std::ranges::stable_sort(
        pieces, [](const LatticePiece& a, const LatticePiece& b) { return a.size() > b.size(); });
    return pieces;
  }

 private:
  [[nodiscard]] Eigen::Vector2d step_m(MarkId from, MarkId to) const override {
    return plane_.pitch_m * Eigen::Vector2d(to.col - from.col, to.row - from.row);
  }

  /// Map at a dot that finds the most of its four neighbours. The ellipse leaves the rotation open;
  /// each dot about a pitch away suggests one.
  [[nodiscard]] std::optional<Start> start_at(std::size_t dot) {
    const Eigen::Matrix2d& root = steps_.root(dot);
    const Eigen::Matrix2d undo = root.inverse();
    const Eigen::Vector2d side(1, plane_.row_sign);  // the visible side is the printed one
    std::optional<Start> best;
    taken_[dot] = 1;  // no step leads to it again
    const double reach = farthest_in_pitches * plane_.pitch_m * root.norm();
    for (const std::size_t k : steps_.cells().within(dots_[dot].centre_px, reach)) {
      if (taken_[k] != 0) continue;
      const Eigen::Vector2d away =
          undo * (dots_[k].centre_px - dots_[dot].centre_px) / plane_.pitch_m;
      const double distance = away.norm();
      if (distance < nearest_in_pitches || distance > farthest_in_pitches) continue;
      Eigen::Matrix2d rotation;
      rotation << away.x(), -away.y(), away.y(), away.x();
      const Start start = judged(dot, root * (rotation / distance) * side.asDiagonal());
      if (start.directions < least_directions) continue;
      if (!best || start.directions > best->directions ||
          (start.directions == best->directions && start.error < best->error)) {
        best = start;
      }
    }
    taken_[dot] = 0;
    return best;
  }

  [[nodiscard]] Start judged(std::size_t dot, const Eigen::Matrix2d& px_per_m) const {
    Start start{0, 0, dot, px_per_m};
    int left = static_cast<int>(neighbours.size());
    for (const MarkId step : neighbours) {
      if (start.directions + left-- < least_directions) break;
      const BestStep found =
          steps_.best({dots_[dot].centre_px, px_per_m}, step_m({}, step), taken_);
      if (!found.is_clear() || found.error > blind_step_error) continue;
      ++start.directions;
      start.error += found.error;
    }
    if (start.directions > 0) start.error /= start.directions;
    return start;
  }

  LatticePiece grown(const Start& start) {
    maps_.clear();
    placed_.clear();
    queue_.push({0, {0, 0}, start.dot, {dots_[start.dot].centre_px, start.px_per_m}});
    grow();
    return from_zero(placed_);
  }

  [[nodiscard]] bool leads_on(std::size_t dot) const override { return dots_[dot].sound; }
  [[nodiscard]] bool may_step(MarkId, MarkId, const LocalMap&) const override { return true; }

  /// True if the piece fits on the print with it, and every neighbour in the piece is one step
  /// away; a single neighbour must match closely.
  [[nodiscard]] bool is_credible(const DotProposal& proposal) const override {
    if (placed_.empty()) return true;
    int supporters = 0;
    for (const MarkId step : neighbours) {
      const auto from = maps_.find(proposal.mark - step);
      if (from == maps_.end()) continue;
      const LocalMap to = steps_.map_at(proposal.dot, from->second);
      if (step_error(from->second, to, step_m({}, step)) > most_step_error) return false;
      ++supporters;
    }
    const double support = std::min(1.0, (supporters - 1) / 2.0);
    return proposal.error <= step_tolerance(support) &&
           fits_print(plane_, extent_of(placed_).with(proposal.mark));
  }
};

/// Homography from lattice positions (col, row) to pixels; nullopt for collinear dots.
std::optional<Eigen::Matrix3d> map_of(const std::vector<UnlabelledDot>& dots,
                                      const LatticePiece& piece) {
  std::vector<Eigen::Vector2d> from, to;
  for (const auto& [place, dot] : piece) {
    from.emplace_back(place.col, place.row);
    to.push_back(dots[dot].centre_px);
  }
  return homography(from, to);
}

Eigen::Vector2d seen(const Eigen::Matrix3d& map, MarkId place) {
  return mapped(map, {place.col, place.row});
}

/// The dot nearest to a lattice position's predicted pixel, if it is close and has a dot's size.
std::optional<std::size_t> dot_at(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                                  const DotCells& cells, const Eigen::Matrix3d& map, MarkId place,
                                  const std::vector<char>& taken) {
  const Eigen::Vector2d px = seen(map, place);
  Eigen::Matrix2d pitches;
  pitches << seen(map, place + MarkId{0, 1}) - px, seen(map, place + MarkId{1, 0}) - px;
  const double radius = plane.dot_radius_m / plane.pitch_m;
  const double area = std::abs(pitches.determinant()) * radius * radius;
  std::optional<std::size_t> nearest;
  double least = most_flat_miss * pitches.colwise().norm().minCoeff();
  for (const std::size_t k : cells.within(px, least)) {
    const double miss = (dots[k].centre_px - px).norm();
    if (taken[k] != 0 || !dots[k].sound || miss > least) continue;
    const double own_area = std::sqrt(std::max(0.0, dots[k].shape_px2.determinant()));
    if (own_area < area / most_area_ratio || own_area > area * most_area_ratio) continue;
    least = miss;
    nearest = k;
  }
  return nearest;
}

/// Direction of the columns: px to the right per two columns.
double rightwards(const std::vector<UnlabelledDot>& dots, const LatticePiece& piece) {
  const auto map = map_of(dots, piece);
  if (!map) return 0;
  const Extent extent = extent_of(piece);
  const MarkId middle{extent.rows() / 2, extent.cols() / 2}, right{0, 1};
  return (seen(*map, middle + right) - seen(*map, middle - right)).x();
}

constexpr int least_known = 12;      // least number of dots that show their class
constexpr double most_wrong = 0.05;  // fraction of them that may disagree at the right position
constexpr double least_lead = 0.15;  // required margin over any other position
constexpr int least_lead_dots = 3;
constexpr int few_lights = 10;          // up to this many marks with light centres count as few
constexpr double most_off_line = 0.25;  // in pitches, for a dot of a plate

/// Position and orientation of a piece on the print.
struct Place {
  int wrong = 0;   ///< number of dots whose class disagrees
  int lights = 0;  ///< number of dots with a light centre that agree
  int quarter = 0;
  MarkId shift;
};

int known_classes(const std::vector<UnlabelledDot>& dots, const LatticePiece& piece) {
  return static_cast<int>(std::ranges::count_if(
      piece, [&](const auto& entry) { return dots[entry.second].light_centre.has_value(); }));
}

bool disagrees(const DotClasses& classes, const UnlabelledDot& dot, MarkId mark) {
  return dot.light_centre && *dot.light_centre != classes.is_light(mark);
}

/// Adds every position at which the piece fits in one of its four orientations.
void add_places(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                const LatticePiece& piece, int quarter, std::vector<Place>& places) {
  const Extent extent = extent_of(piece);
  for (int row = 0; row + extent.rows() <= plane.rows; ++row) {
    for (int col = 0; col + extent.cols() <= plane.cols; ++col) {
      Place candidate{0, 0, quarter, {row, col}};
      if (!plane.contains(piece.begin()->first + candidate.shift)) continue;
      for (const auto& [place, dot] : piece) {
        const MarkId mark = place + candidate.shift;
        candidate.wrong += disagrees(*plane.classes, dots[dot], mark);
        candidate.lights += dots[dot].light_centre == true && plane.classes->is_light(mark);
      }
      places.push_back(candidate);
    }
  }
}

/// True if at least half of each outer row and column is present: a speck a pitch beside the grid,
/// taken for a row, would shift all labels.
bool edges_are_full(const PrintPlane& plane, const LatticePiece& piece) {
  const auto full = [&](MarkId from, MarkId step) {
    int here = 0, all = 0;
    for (MarkId mark = from; mark.row < plane.rows && mark.col < plane.cols; mark = mark + step) {
      all += plane.contains(mark);
      here += piece.count(mark) != 0;
    }
    return 2 * here >= all;
  };
  return full({0, 0}, {0, 1}) && full({plane.rows - 1, 0}, {0, 1}) && full({0, 0}, {1, 0}) &&
         full({0, plane.cols - 1}, {1, 0});
}

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
  int cells = 0;  ///< number of cells of the print around the mark
  int sum = 0;
};

class Labeller : public Grower {
 public:
  Labeller(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots, const DarkMap& map)
      : Grower(plane, dots, std::vector<char>(dots.size(), 0)),
        map_(map),
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
      if (!around.empty()) read_cells_.insert(*std::ranges::min_element(around));
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

  /// Withdraws labels along flat folds: if two adjacent labelled dots are one step from two others
  /// that are not their neighbours, the correct side is unknown, so only dots with two agreeing
  /// tags keep their labels.
  std::vector<DotLabel> finish() {
    while (withdraw_at_rim()) {
    }
    std::map<MarkId, std::vector<MarkId>> seams;
    for (const auto& [mark, dot] : placed_) seams[mark] = contradictions(mark, maps_.at(mark));
    for (const auto& [mark, dot] : placed_) {
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
  [[nodiscard]] Eigen::Vector2d step_m(MarkId from, MarkId to) const override {
    return plane_.point_m(to) - plane_.point_m(from);
  }
  [[nodiscard]] bool leads_on(std::size_t) const override { return true; }
  [[nodiscard]] bool may_step(MarkId from, MarkId to, const LocalMap& there) const override {
    return plane_.contains(to) && !may_be_seam(from, to, maps_.at(from), there);
  }

  /// True if the step error is tolerable; tolerance grows with the support of the label by the
  /// cells around the dot and by other labelled neighbours.
  [[nodiscard]] bool is_credible(const DotProposal& proposal) const override {
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
      supporters +=
          step_error(from->second, to, step_m(from->first, proposal.mark)) <= most_step_error &&
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
        if (step_error(here, maps_.at(*other), step_m(mark, expected)) <= contradicting_error)
          found.push_back(*other);
      }
    }
    return found;
  }

  /// Withdraws isolated labels; true if there were any.
  bool withdraw_at_rim() {
    std::vector<MarkId> alone;
    for (const auto& [mark, dot] : placed_)
      if (stands_alone(mark, dot)) alone.push_back(mark);
    for (const MarkId mark : alone) {
      labels_[placed_.at(mark)] = {
          std::nullopt, "no label: at the rim of what is seen, and little around it speaks for it"};
      placed_.erase(mark);
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
      worst = std::max(worst, step_error(from->second, steps_.map_at(dot, from->second),
                                         step_m(from->first, mark)));
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
        if (std::ranges::find(there, other + step) != there.end()) return true;
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
        if (step_error(here, there, step_m(mark, mark + step)) <= contradicting_error) return true;
      }
    }
    return false;
  }

  /// True if two layers may meet here: a step along flat cloth beside the position of a tag that is
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

  /// Votes of the four cells around a dot on a label: +1 for each that agrees with the print in
  /// showing a tag or none, -1 for each that does not.
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

  /// Fraction of printed pixels at the position of a tag, predicted by the local map of a dot.
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

  const DarkMap& map_;
  std::set<MarkId> read_cells_;
  std::vector<std::size_t> disputed_;  ///< dots with conflicting tags
  std::vector<char> certain_;          ///< dots with two agreeing tags
};

}  // namespace

std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                      const std::vector<UnlabelledDot>& dots,
                                      const std::vector<char>& taken) {
  return PieceGrower(plane, dots, taken).grow_all();
}

void fill_flat_piece(const PrintPlane& print, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece) {
  const PrintPlane plane = grown_plane(print);
  std::vector<char> taken(dots.size(), 0);
  for (const auto& [place, dot] : piece) taken[dot] = 1;
  const DotCells cells(dots);
  for (std::size_t before = 0; piece.size() >= least_flat_dots && piece.size() > before;) {
    before = piece.size();
    const auto map = map_of(dots, piece);
    if (!map) break;
    const Extent extent = extent_of(piece);
    Extent grown = extent;
    // The print can extend beyond the known dots by at most its own length in either direction.
    const int longest = std::max(plane.rows, plane.cols);
    for (int row = extent.last.row - longest + 1; row < extent.first.row + longest; ++row) {
      for (int col = extent.last.col - longest + 1; col < extent.first.col + longest; ++col) {
        const MarkId place{row, col};
        if (piece.count(place) != 0 || !fits_print(plane, grown.with(place))) continue;
        const auto dot = dot_at(plane, dots, cells, *map, place, taken);
        if (!dot) continue;
        grown = grown.with(place);
        piece[place] = *dot;
        taken[*dot] = 1;
      }
    }
  }
  if (!piece.empty()) piece = from_zero(piece);
}

std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                              const std::vector<UnlabelledDot>& dots,
                                              const LatticePiece& piece) {
  std::optional<LatticePiece> best;
  double most_rightwards = 0;
  LatticePiece turned = along_rows(plane, piece);
  for (int quarter = 0; quarter < 4; ++quarter, turned = quarter_turn(turned)) {
    const Extent extent = extent_of(turned);
    if (extent.rows() != plane.rows || extent.cols() != plane.cols) continue;
    if (!plane.contains(turned.begin()->first) || !edges_are_full(plane, turned)) continue;
    const double right = rightwards(dots, turned);
    if (best && right <= most_rightwards) continue;
    best = turned;
    most_rightwards = right;
  }
  return best;
}

std::optional<LatticePiece> place_by_classes(const PrintPlane& plane,
                                             const std::vector<UnlabelledDot>& dots,
                                             const LatticePiece& piece) {
  const int known = known_classes(dots, piece);
  if (!plane.classes || known < least_known) return std::nullopt;
  std::vector<Place> places;
  std::array<LatticePiece, 4> turned = {along_rows(plane, piece)};
  for (int quarter = 0; quarter < 4; ++quarter) {
    if (quarter > 0) turned[quarter] = quarter_turn(turned[quarter - 1]);
    add_places(plane, dots, turned[quarter], quarter, places);
  }
  int lights = 0;
  for (const std::string& row : plane.classes->rows)
    lights += static_cast<int>(std::ranges::count(row, 'o'));
  const bool few = few_lights * lights < plane.rows * plane.cols;
  if (few) std::erase_if(places, [&](const Place& place) { return place.lights < lights; });
  std::ranges::stable_sort(places, {}, &Place::wrong);
  if (places.empty() || places[0].wrong > most_wrong * known) return std::nullopt;
  const double lead = std::max<double>(least_lead_dots, least_lead * known);
  if (places.size() > 1 && (few || places[1].wrong < places[0].wrong + lead)) return std::nullopt;
  LatticePiece result;
  for (const auto& [place, dot] : turned[places[0].quarter]) {
    const MarkId mark = place + places[0].shift;
    if (!disagrees(*plane.classes, dots[dot], mark)) result[mark] = dot;
  }
  return result;
}

std::vector<std::size_t> off_the_plate(const std::vector<UnlabelledDot>& dots,
                                       const LatticePiece& labelled) {
  const auto at = [&](MarkId mark) -> const Eigen::Vector2d* {
    const auto found = labelled.find(mark);
    return found == labelled.end() ? nullptr : &dots[found->second].centre_px;
  };
  std::vector<std::size_t> off;
  for (const auto& [mark, dot] : labelled) {
    int asked = 0, missed = 0;
    const auto ask = [&](const Eigen::Vector2d& expected, const Eigen::Vector2d& step) {
      ++asked;
      missed += (expected - dots[dot].centre_px).norm() > most_off_line * step.norm();
    };
    constexpr std::array<MarkId, 4> lines = {{{0, 1}, {1, 0}, {1, 1}, {1, -1}}};
    for (const MarkId step : lines) {
      const auto *before = at(mark - step), *after = at(mark + step);
      if (before != nullptr && after != nullptr)
        ask((*before + *after) / 2, (*after - *before) / 2);
    }
    for (std::size_t k = 0; k < 2 * lines.size() && asked == 0; ++k) {
      const MarkId step = k % 2 == 0 ? lines[k / 2] : MarkId{0, 0} - lines[k / 2];
      const auto *next = at(mark + step), *second = at(mark + step + step);
      if (next != nullptr && second != nullptr) ask(2 * *next - *second, *next - *second);
    }
    if (2 * missed > asked) off.push_back(dot);
  }
  return off;
}

std::vector<DotLabel> label_dots(const PrintPlane& plane, const std::vector<TagDetection>& tags,
                                 const std::vector<UnlabelledDot>& dots, const DarkMap& map) {
  Labeller labeller(plane, dots, map);
  labeller.seed(tags);
  labeller.grow();
  return labeller.finish();
}

}  // namespace drape::detect

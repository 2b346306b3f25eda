// SPDX-License-Identifier: Apache-2.0
#include "detect/labels/lattice.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>

namespace drape::detect {
namespace {

constexpr double nearest_in_pitches = 0.6;  // of a neighbour, in the dot's own map
constexpr double farthest_in_pitches = 1.4;
constexpr int least_directions = 3;  // of the four, in which a start has a clear neighbour
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

struct Proposal {
  double error = 0;
  MarkId place;
  std::size_t dot = 0;
  LocalMap map;
};

struct Later {
  bool operator()(const Proposal& a, const Proposal& b) const {
    return std::tie(a.error, a.place, a.dot) > std::tie(b.error, b.place, b.dot);
  }
};

struct Extent {
  MarkId first, last;
  [[nodiscard]] int rows() const { return last.row - first.row + 1; }
  [[nodiscard]] int cols() const { return last.col - first.col + 1; }
};

template <class Places>
Extent extent_of(const Places& places) {
  Extent extent{places.begin()->first, places.begin()->first};
  for (const auto& [place, unused] : places) {
    extent.first.row = std::min(extent.first.row, place.row);
    extent.first.col = std::min(extent.first.col, place.col);
    extent.last.row = std::max(extent.last.row, place.row);
    extent.last.col = std::max(extent.last.col, place.col);
  }
  return extent;
}

/// No piece is larger than the print, however it is turned.
bool fits_print(const PrintPlane& plane, const LatticePiece& piece, MarkId place) {
  Extent extent = extent_of(piece);
  extent.first.row = std::min(extent.first.row, place.row);
  extent.first.col = std::min(extent.first.col, place.col);
  extent.last.row = std::max(extent.last.row, place.row);
  extent.last.col = std::max(extent.last.col, place.col);
  const auto [shorter, longer] = std::minmax({extent.rows(), extent.cols()});
  return shorter <= std::min(plane.rows, plane.cols) && longer <= std::max(plane.rows, plane.cols);
}

class PieceGrower {
 public:
  PieceGrower(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
              const std::vector<char>& taken)
      : plane_(plane), dots_(dots), steps_(dots, plane.dot_radius_m), taken_(taken) {}

  std::vector<LatticePiece> grow_all() {
    std::vector<Start> starts;
    for (std::size_t k = 0; k < dots_.size(); ++k) {
      if (taken_[k] != 0 || !dots_[k].sound) continue;
      if (const auto start = start_at(k)) starts.push_back(*start);
    }
    std::stable_sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) {
      return a.directions != b.directions ? a.directions > b.directions : a.error < b.error;
    });
    std::vector<LatticePiece> pieces;
    for (const Start& start : starts) {
      if (taken_[start.dot] != 0) continue;
      LatticePiece piece = grow(start);
      if (piece.size() >= least_piece) pieces.push_back(std::move(piece));
    }
    std::stable_sort(
        pieces.begin(), pieces.end(),
        [](const LatticePiece& a, const LatticePiece& b) { return a.size() > b.size(); });
    return pieces;
  }

 private:
  [[nodiscard]] Eigen::Vector2d step_m(MarkId step) const {
    return plane_.pitch_m * Eigen::Vector2d(step.col, step.row);
  }

  /// The map at a dot under which most of the four neighbours are there; its ellipse leaves a
  /// rotation open, which each dot about a pitch away proposes.
  [[nodiscard]] std::optional<Start> start_at(std::size_t dot) const {
    const Eigen::Matrix2d& root = steps_.root(dot);
    const Eigen::Matrix2d undo = root.inverse();
    const Eigen::Vector2d side(1, plane_.row_sign);  // the printed side is the one that is seen
    std::optional<Start> best;
    for (std::size_t k = 0; k < dots_.size(); ++k) {
      if (k == dot || taken_[k] != 0) continue;
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
    return best;
  }

  [[nodiscard]] Start judged(std::size_t dot, const Eigen::Matrix2d& px_per_m) const {
    std::vector<char> others = taken_;
    others[dot] = 1;
    Start start{0, 0, dot, px_per_m};
    for (const MarkId step : neighbours) {
      const BestStep found = steps_.best({dots_[dot].centre_px, px_per_m}, step_m(step), others);
      if (!found.is_clear() || found.error > blind_step_error) continue;
      ++start.directions;
      start.error += found.error;
    }
    if (start.directions > 0) start.error /= start.directions;
    return start;
  }

  LatticePiece grow(const Start& start) {
    maps_.clear();
    queue_ = {};
    LatticePiece piece;
    queue_.push({0, {0, 0}, start.dot, {dots_[start.dot].centre_px, start.px_per_m}});
    std::size_t before = 0;
    do {
      before = piece.size();
      drain(piece);
      // A rival that has found its own place no longer makes a step doubtful.
      for (const auto& [place, dot] : LatticePiece(piece)) lead_on(place);
      drain(piece);
    } while (piece.size() > before);
    const MarkId first = extent_of(piece).first;
    LatticePiece result;
    for (const auto& [place, dot] : piece) {
      result[{place.row - first.row, place.col - first.col}] = dot;
    }
    return result;
  }

  void drain(LatticePiece& piece) {
    while (!queue_.empty()) {
      const Proposal next = queue_.top();
      queue_.pop();
      if (taken_[next.dot] != 0 || piece.count(next.place) != 0) continue;
      if (!piece.empty() && (!agrees(next) || !fits_print(plane_, piece, next.place))) continue;
      piece[next.place] = next.dot;
      taken_[next.dot] = 1;
      maps_[next.place] = next.map;
      if (dots_[next.dot].sound) lead_on(next.place);
    }
  }

  void lead_on(MarkId from) {
    for (const MarkId step : neighbours) {
      const MarkId place{from.row + step.row, from.col + step.col};
      if (maps_.count(place) != 0) continue;
      const BestStep found = steps_.best(maps_.at(from), step_m(step), taken_);
      if (found.is_clear()) queue_.push({found.error, place, found.dot, found.to});
    }
  }

  /// Every neighbour that the piece has must be one step away; one alone must be so by little.
  [[nodiscard]] bool agrees(const Proposal& proposal) const {
    int supporters = 0;
    for (const MarkId step : neighbours) {
      const auto from = maps_.find({proposal.place.row - step.row, proposal.place.col - step.col});
      if (from == maps_.end()) continue;
      const LocalMap to = steps_.map_at(proposal.dot, from->second);
      if (step_error(from->second, to, step_m(step)) > most_step_error) return false;
      ++supporters;
    }
    const double support = std::min(1.0, (supporters - 1) / 2.0);
    return proposal.error <= blind_step_error + (most_step_error - blind_step_error) * support;
  }

  const PrintPlane& plane_;
  const std::vector<UnlabelledDot>& dots_;
  DotSteps steps_;
  std::vector<char> taken_;
  std::map<MarkId, LocalMap> maps_;
  std::priority_queue<Proposal, std::vector<Proposal>, Later> queue_;
};

using Homography = Eigen::Matrix3d;

/// Projective map from places (col, row) to pixels by least squares on the algebraic error, in
/// coordinates scaled to about one (Hartley 1997).
Homography homography_of(const std::vector<UnlabelledDot>& dots, const LatticePiece& piece) {
  Eigen::Vector2d mean_place = Eigen::Vector2d::Zero(), mean_px = Eigen::Vector2d::Zero();
  const auto count = static_cast<double>(piece.size());
  for (const auto& [place, dot] : piece) {
    mean_place += Eigen::Vector2d(place.col, place.row) / count;
    mean_px += dots[dot].centre_px / count;
  }
  double spread_place = 0, spread_px = 0;
  for (const auto& [place, dot] : piece) {
    spread_place += (Eigen::Vector2d(place.col, place.row) - mean_place).norm() / count;
    spread_px += (dots[dot].centre_px - mean_px).norm() / count;
  }
  Eigen::Matrix<double, 9, 9> square = Eigen::Matrix<double, 9, 9>::Zero();
  for (const auto& [place, dot] : piece) {
    const Eigen::Vector2d q = (Eigen::Vector2d(place.col, place.row) - mean_place) / spread_place;
    const Eigen::Vector2d p = (dots[dot].centre_px - mean_px) / spread_px;
    Eigen::Matrix<double, 2, 9> rows;
    rows << q.x(), q.y(), 1, 0, 0, 0, -p.x() * q.x(), -p.x() * q.y(), -p.x(),  //
        0, 0, 0, q.x(), q.y(), 1, -p.y() * q.x(), -p.y() * q.y(), -p.y();
    square += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(square);
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  Homography scaled, from_place, to_px;
  scaled << h(0), h(1), h(2), h(3), h(4), h(5), h(6), h(7), h(8);
  from_place << 1 / spread_place, 0, -mean_place.x() / spread_place,  //
      0, 1 / spread_place, -mean_place.y() / spread_place, 0, 0, 1;
  to_px << spread_px, 0, mean_px.x(), 0, spread_px, mean_px.y(), 0, 0, 1;
  return to_px * scaled * from_place;
}

Eigen::Vector2d seen(const Homography& map, MarkId place) {
  return (map * Eigen::Vector3d(place.col, place.row, 1)).hnormalized();
}

/// The dot nearest to where a place must be seen, if that is near enough and it has a dot's size.
std::optional<std::size_t> dot_at(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                                  const Homography& map, MarkId place,
                                  const std::vector<char>& taken) {
  const Eigen::Vector2d px = seen(map, place);
  Eigen::Matrix2d pitches;
  pitches << seen(map, {place.row, place.col + 1}) - px, seen(map, {place.row + 1, place.col}) - px;
  const double radius = plane.dot_radius_m / plane.pitch_m;
  const double area = std::abs(pitches.determinant()) * radius * radius;
  std::optional<std::size_t> nearest;
  double least = most_flat_miss * pitches.colwise().norm().minCoeff();
  for (std::size_t k = 0; k < dots.size(); ++k) {
    const double miss = (dots[k].centre_px - px).norm();
    if (taken[k] != 0 || !dots[k].sound || miss > least) continue;
    const double own_area = std::sqrt(std::max(0.0, dots[k].shape_px2.determinant()));
    if (own_area < area / most_area_ratio || own_area > area * most_area_ratio) continue;
    least = miss;
    nearest = k;
  }
  return nearest;
}

/// How far the columns run to the right, px per column.
double rightwards(const std::vector<UnlabelledDot>& dots, const LatticePiece& piece) {
  const Homography map = homography_of(dots, piece);
  const Extent extent = extent_of(piece);
  const MarkId middle{extent.rows() / 2, extent.cols() / 2};
  const Eigen::Vector2d along =
      seen(map, {middle.row, middle.col + 1}) - seen(map, {middle.row, middle.col - 1});
  return along.x();
}

/// Half or more of each outer row and column is there: a speck a pitch beside the grid is no row of
/// it, and taken for one it would shift all labels.
bool edges_are_full(const LatticePiece& piece, const Extent& extent) {
  int top = 0, bottom = 0, left = 0, right = 0;
  for (const auto& [place, dot] : piece) {
    top += place.row == extent.first.row ? 1 : 0;
    bottom += place.row == extent.last.row ? 1 : 0;
    left += place.col == extent.first.col ? 1 : 0;
    right += place.col == extent.last.col ? 1 : 0;
  }
  return 2 * std::min(top, bottom) >= extent.cols() && 2 * std::min(left, right) >= extent.rows();
}

}  // namespace

std::vector<LatticePiece> grow_pieces(const PrintPlane& plane,
                                      const std::vector<UnlabelledDot>& dots,
                                      const std::vector<char>& taken) {
  return PieceGrower(plane, dots, taken).grow_all();
}

void fill_flat_piece(const PrintPlane& plane, const std::vector<UnlabelledDot>& dots,
                     LatticePiece& piece) {
  std::vector<char> taken(dots.size(), 0);
  for (const auto& [place, dot] : piece) taken[dot] = 1;
  for (std::size_t before = 0; piece.size() >= least_flat_dots && piece.size() > before;) {
    before = piece.size();
    const Homography map = homography_of(dots, piece);
    const Extent extent = extent_of(piece);
    // As far as the print can reach beyond what is known, in either direction.
    const int longest = std::max(plane.rows, plane.cols);
    for (int row = extent.last.row - longest + 1; row < extent.first.row + longest; ++row) {
      for (int col = extent.last.col - longest + 1; col < extent.first.col + longest; ++col) {
        if (piece.count({row, col}) != 0 || !fits_print(plane, piece, {row, col})) continue;
        const auto dot = dot_at(plane, dots, map, {row, col}, taken);
        if (!dot) continue;
        piece[{row, col}] = *dot;
        taken[*dot] = 1;
      }
    }
  }
  if (piece.empty()) return;
  const MarkId first = extent_of(piece).first;
  LatticePiece shifted;
  for (const auto& [place, dot] : piece) {
    shifted[{place.row - first.row, place.col - first.col}] = dot;
  }
  piece = std::move(shifted);
}

LatticePiece quarter_turn(const LatticePiece& piece) {
  const int last_row = extent_of(piece).last.row;
  LatticePiece turned;
  for (const auto& [place, dot] : piece) turned[{place.col, last_row - place.row}] = dot;
  return turned;
}

std::optional<LatticePiece> place_whole_piece(const PrintPlane& plane,
                                              const std::vector<UnlabelledDot>& dots,
                                              const LatticePiece& piece) {
  std::optional<LatticePiece> best;
  double most_rightwards = 0;
  LatticePiece turned = piece;
  for (int quarter = 0; quarter < 4; ++quarter, turned = quarter_turn(turned)) {
    const Extent extent = extent_of(turned);
    if (extent.rows() != plane.rows || extent.cols() != plane.cols) continue;
    if (!edges_are_full(turned, extent)) continue;
    const double right = rightwards(dots, turned);
    if (best && right <= most_rightwards) continue;
    best = turned;
    most_rightwards = right;
  }
  return best;
}

}  // namespace drape::detect

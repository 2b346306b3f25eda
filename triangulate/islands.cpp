// SPDX-License-Identifier: Apache-2.0
#include "triangulate/islands.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "triangulate/point.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Vector3d;

constexpr std::array<MarkId, 4> lattice_steps = {{{0, 1}, {1, 0}, {0, -1}, {-1, 0}}};

/// One island in its frame.
struct Island {
  std::size_t frame = 0;
  int number = 0;
  std::vector<Detection> dots;  ///< marks are positions within the piece
  bool merged = false;
  std::string reason;
};

/// A candidate position of an island on the lattice: quarter turns, then a shift.
struct Laying {
  int turns = 0;
  MarkId shift;
  [[nodiscard]] MarkId operator()(MarkId place) const {
    MarkId turned = place;
    for (int k = 0; k < turns; ++k) turned = {turned.col, -turned.row};
    return {turned.row + shift.row, turned.col + shift.col};
  }
};

/// Evidence for and against a candidate position.
struct Verdict {
  Laying laying;
  int evidence = 0;  ///< pixel coordinates that agree, less those needed to locate the points
  int agreeing = 0;
  int links = 0;
  int refutations = 0;
  [[nodiscard]] bool is_tested() const { return agreeing > 0; }
};

std::optional<View> view_of(const Detection& d, const CalibratedCamera& camera, double shape_px) {
  if (!d.centre_px.allFinite() || !d.covariance_px2.allFinite() ||
      d.covariance_px2.llt().info() != Eigen::Success) {
    return std::nullopt;
  }
  View view;
  view.camera = &camera;
  view.px = d.centre_px;
  view.covariance_px2 = d.covariance_px2 + shape_px * shape_px * Eigen::Matrix2d::Identity();
  return view;
}

/// The labelled views of a set, and the points on which at least two of them agree.
class Labelled {
 public:
  Labelled(const Detections& detections, const Calibration& calibration,
           const IslandOptions& options)
      : calibration_(calibration), options_(options) {
    for (std::size_t f = 0; f < detections.frames.size(); ++f) {
      for (const Detection& d : detections.frames[f].detections) add(f, detections.frames[f], d);
    }
    for (const auto& [mark, unused] : views_) place(mark);
  }

  void add(std::size_t frame, const FrameDetections& of, const Detection& d) {
    const auto view = view_of(d, calibration_.camera(of.camera), options_.shape_px);
    if (view) views_[d.mark].emplace(frame, *view);
  }

  void place(MarkId mark) {
    const std::vector<View> views = of_others(mark, no_frame);
    if (views.size() < 2) return;
    if (const auto point = agreed(views)) points_[mark] = *point;
  }

  [[nodiscard]] bool has(MarkId mark, std::size_t frame) const {
    const auto found = views_.find(mark);
    return found != views_.end() && found->second.count(frame) != 0;
  }

  [[nodiscard]] std::vector<View> of_others(MarkId mark, std::size_t frame) const {
    std::vector<View> others;
    const auto found = views_.find(mark);
    if (found == views_.end()) return others;
    for (const auto& [in_frame, view] : found->second) {
      if (in_frame != frame) others.push_back(view);
    }
    return others;
  }

  /// Point at which the views meet; nullopt if they do not.
  [[nodiscard]] std::optional<Vector3d> agreed(const std::vector<View>& views) const {
    const Point point = solve_point(views, options_.min_angle_rad);
    if (point.status != PointStatus::good || point.disagreement_sigmas() > options_.most_sigmas) {
      return std::nullopt;
    }
    return point.in_world;
  }

  [[nodiscard]] const std::map<MarkId, Vector3d>& points() const { return points_; }

  static constexpr std::size_t no_frame = static_cast<std::size_t>(-1);

 private:
  const Calibration& calibration_;
  const IslandOptions& options_;
  std::map<MarkId, std::map<std::size_t, View>> views_;
  std::map<MarkId, Vector3d> points_;
};

class Merger {
 public:
  Merger(const Detections& detections, const Calibration& calibration, const std::string& set,
         const IslandOptions& options)
      : calibration_(calibration), options_(options) {
    result_.detections = detections;
    std::erase_if(result_.detections.frames,
                  [&](const FrameDetections& frame) { return frame.set != set; });
    for (std::size_t f = 0; f < result_.detections.frames.size(); ++f) collect(f);
  }

  MergedIslands run() {
    Labelled labelled(result_.detections, calibration_, options_);
    for (bool again = true; again;) {
      again = false;
      for (Island& island : islands_) {
        if (!island.merged) again |= try_to_merge(island, labelled);
      }
    }
    finish();
    return std::move(result_);
  }

 private:
  void collect(std::size_t f) {
    std::map<int, Island> by_number;
    for (const IslandDot& d : result_.detections.frames[f].islands) {
      Island& island = by_number[d.island];
      island.frame = f;
      island.number = d.island;
      island.dots.push_back(d.dot);
    }
    for (const auto& [number, island] : by_number) islands_.push_back(island);
  }

  [[nodiscard]] bool is_on_lattice(MarkId mark) const {
    const MarkLattice& lattice = result_.detections.lattice;
    return mark.row >= 0 && mark.col >= 0 && mark.row < lattice.rows && mark.col < lattice.cols;
  }

  bool try_to_merge(Island& island, Labelled& labelled) {
    std::vector<Verdict> standing;  // positions with support from some view and few refutations
    for (const Laying& laying : layings(island)) {
      const Verdict verdict = judged(island, laying, labelled);
      if (verdict.is_tested() && verdict.refutations < options_.least_refutations)
        standing.push_back(verdict);
    }
    if (standing.size() != 1) {
      island.reason = standing.empty()
                          ? "left alone: no view speaks for any place of it"
                          : fmt::format("left alone: {} places fit it", standing.size());
      return false;
    }
    const Verdict& best = standing.front();
    if (best.refutations > 0 || best.evidence < options_.least_evidence ||
        best.links < options_.least_links) {
      island.reason = fmt::format(
          "left alone: its best place has {} coordinates that agree, {} neighbours in reach and {} "
          "contradictions",
          best.evidence, best.links, best.refutations);
      return false;
    }
    take(island, best, labelled);
    return true;
  }

  /// All positions of the island entirely within the lattice.
  [[nodiscard]] std::vector<Laying> layings(const Island& island) const {
    const MarkLattice& lattice = result_.detections.lattice;
    std::vector<Laying> all;
    for (int turns = 0; turns < 4; ++turns) {
      const Laying turn{turns, {0, 0}};
      MarkId least = turn(island.dots.front().mark), most = least;
      for (const Detection& d : island.dots) {
        const MarkId mark = turn(d.mark);
        least = {std::min(least.row, mark.row), std::min(least.col, mark.col)};
        most = {std::max(most.row, mark.row), std::max(most.col, mark.col)};
      }
      for (int row = -least.row; row + most.row < lattice.rows; ++row) {
        for (int col = -least.col; col + most.col < lattice.cols; ++col)
          all.push_back({turns, {row, col}});
      }
    }
    return all;
  }

  [[nodiscard]] Verdict judged(const Island& island, const Laying& laying,
                               const Labelled& labelled) const {
    Verdict verdict{laying, 0, 0, 0, 0};
    std::map<MarkId, Vector3d> points;
    for (const Detection& d : island.dots) {
      const MarkId mark = laying(d.mark);
      if (labelled.has(mark, island.frame)) ++verdict.refutations;  // the frame has this mark
      if (verdict.refutations >= options_.least_refutations) return verdict;
      std::vector<View> views = labelled.of_others(mark, island.frame);
      const auto own = view_of(d, camera_of(island), options_.shape_px);
      if (views.empty() || !own) continue;
      const int others = static_cast<int>(views.size());
      views.push_back(*own);
      if (const auto point = labelled.agreed(views)) {
        points[mark] = *point;
        ++verdict.agreeing;
        verdict.evidence += others == 1 ? 1 : 2;
      } else {
        ++verdict.refutations;
      }
    }
    test_distances(points, labelled, verdict);
    return verdict;
  }

  /// Tests the distances of the island's new points from neighbours inside and outside the island.
  void test_distances(const std::map<MarkId, Vector3d>& points, const Labelled& labelled,
                      Verdict& verdict) const {
    const double pitch = result_.detections.lattice.pitch_m;
    for (const auto& [mark, point] : points) {
      for (const MarkId step : lattice_steps) {
        for (const int far : {1, 2}) {
          const MarkId other{mark.row + far * step.row, mark.col + far * step.col};
          const auto inside = points.find(other);
          const auto outside = labelled.points().find(other);
          const bool known = outside != labelled.points().end();
          if (inside == points.end() && !known) continue;
          const double distance = (point - (known ? outside->second : inside->second)).norm();
          const bool reaches = distance <= far * pitch * options_.most_stretch;
          const bool too_near = far == 1 && distance < pitch * options_.least_chord;
          if (!reaches || too_near) {
            ++verdict.refutations;
          } else if (known && far == 1) {
            ++verdict.links;
          }
        }
      }
    }
  }

  void take(Island& island, const Verdict& verdict, Labelled& labelled) {
    FrameDetections& frame = result_.detections.frames[island.frame];
    for (const Detection& d : island.dots) {
      const MarkId mark = verdict.laying(d.mark);
      if (labelled.has(mark, island.frame)) continue;
      Detection labelled_dot = d;
      labelled_dot.mark = mark;
      frame.detections.push_back(labelled_dot);
      labelled.add(island.frame, frame, labelled_dot);
      labelled.place(mark);
    }
    island.merged = true;
    island.reason =
        fmt::format("merged: {} of its dots agree with other views, {} neighbours in reach",
                    verdict.agreeing, verdict.links);
  }

  [[nodiscard]] const CalibratedCamera& camera_of(const Island& island) const {
    return calibration_.camera(result_.detections.frames[island.frame].camera);
  }

  void finish() {
    for (const Island& island : islands_) {
      FrameDetections& frame = result_.detections.frames[island.frame];
      result_.fates.push_back({frame.camera, island.number, static_cast<int>(island.dots.size()),
                               island.merged, island.reason});
      if (!island.merged) continue;
      std::erase_if(frame.islands, [&](const IslandDot& d) { return d.island == island.number; });
    }
    for (FrameDetections& frame : result_.detections.frames) {
      std::sort(frame.detections.begin(), frame.detections.end(),
                [](const Detection& a, const Detection& b) { return a.mark < b.mark; });
    }
  }

  const Calibration& calibration_;
  const IslandOptions& options_;
  MergedIslands result_;
  std::vector<Island> islands_;
};

}  // namespace

MergedIslands merge_islands(const Detections& detections, const Calibration& calibration,
                            const std::string& set, const IslandOptions& options) {
  return Merger(detections, calibration, set, options).run();
}

}  // namespace drape::triangulate

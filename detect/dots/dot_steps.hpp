// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "detect/dots/local_map.hpp"

namespace drape::detect {

/// A dot to be labelled.
struct UnlabelledDot {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d shape_px2;
  bool sound = true;                      ///< only sound dots lead on to their neighbours
  std::optional<bool> light_centre = {};  ///< class, where the print has two and this dot shows it
};

/// The dot that fits a step from a known place best, and how clearly.
struct BestStep {
  double error = 1e9;   ///< see step_error(); large when no dot fits at all
  double second = 1e9;  ///< of the next best dot
  std::size_t dot = 0;
  LocalMap to;  ///< the local map at that dot

  /// True when the step misses by little and no other dot fits nearly as well.
  [[nodiscard]] bool is_clear() const;
};

// A correct step misses by the change of curvature along it: a few per cent on gentle cloth, up to
// a quarter of a step where a fold begins. A wrong dot misses by about one step.
inline constexpr double most_step_error = 0.28;
inline constexpr double blind_step_error = 0.10;  ///< without support from what is around

/// The dots of a frame as goals of steps. Keeps a reference to `dots`.
class DotSteps {
 public:
  DotSteps(const std::vector<UnlabelledDot>& dots, double dot_radius_m);

  /// Best of the dots that are not `taken` (same order as the dots).
  [[nodiscard]] BestStep best(const LocalMap& from, const Eigen::Vector2d& step_m,
                              const std::vector<char>& taken) const;

  /// Local map at a dot, turned as near to a neighbour's as its ellipse allows.
  [[nodiscard]] LocalMap map_at(std::size_t dot, const LocalMap& neighbour) const {
    return {dots_[dot].centre_px, turned_root(roots_[dot], neighbour.px_per_m)};
  }

  /// Symmetric root of a dot's ellipse, px per m of the print.
  [[nodiscard]] const Eigen::Matrix2d& root(std::size_t dot) const { return roots_[dot]; }

 private:
  const std::vector<UnlabelledDot>& dots_;
  std::vector<Eigen::Matrix2d> roots_;
  std::vector<double> sizes_;  ///< Frobenius norms of the roots
};

}  // namespace drape::detect

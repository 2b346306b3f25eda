// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// Result of a drape on one mesh.
struct LevelReport {
  double spacing_m = 0;
  int points = 0;
  RestReport rest;
  /// Mean move of the print's marks from the next coarser mesh; absent on the coarsest.
  std::optional<double> moved_m;
};

/// A drape from its start to rest on the finest mesh.
struct Drape {
  std::shared_ptr<DrapeLevel> level;  ///< the finest level
  ClothMoment rest;
  std::vector<LevelReport> levels;  ///< ordered from coarse to fine, up to the last one reached
  /// Positions of the print's marks on each level (local frame), one row per mark in the order of
  /// `marks`.
  std::vector<Eigen::MatrixX3d> marks_of_level;
  std::vector<MarkId> marks;
  /// Estimated distance (m) of each mark from the limit of infinite refinement; empty for one
  /// level. See mesh_error_m().
  Eigen::VectorXd mesh_error_m;
  std::vector<std::string> warnings;

  [[nodiscard]] bool at_rest() const { return levels.back().rest.at_rest; }
};

/// Estimated distance (m) of each mark from the limit of infinite refinement, for two levels or
/// more: F d / (r - 1) (grid convergence index: Roache 1994), with d the move of the mark between
/// the last two levels and r the ratio by which the mean of d decreased from the level before.
/// The safety factor F is 1.25 where the order of convergence seen on three levels is within 0.2 of
/// 2, that of contact and bending, and neither pins nor clamps hold the cloth; else 3 (Oberkampf
/// and Roy 2010, section 8.6.4). r is limited to 2 .. 4; to 3 with pins, near which the stretch
/// grows with the logarithm of the spacing, masked at first by other errors. Two levels show no r:
/// it is 4, or 2 with pins. d is at least half of its mean over the marks, since a mark may cross
/// its limit. `marks_of_level` has a row per mark.
[[nodiscard]] Eigen::VectorXd mesh_error_m(const DrapeCase& drape,
                                           const std::vector<LevelReport>& levels,
                                           const std::vector<Eigen::MatrixX3d>& marks_of_level);

/// Returns the start of a cloth on the coarsest mesh, in place of DrapeLevel::start().
using DrapeStart = std::function<ClothMoment(const DrapeLevel& level)>;

/// Called with the fraction of the work done.
using DrapeProgress = std::function<void(double fraction)>;

/// Drapes a cloth in nested levels: it falls in time on the coarsest mesh; then shape, friction and
/// memory are transferred to each finer mesh and relaxed to rest there. Starts from the measured
/// shape and histories are described in start.hpp. A cloth that passes through itself is draped
/// again from the same start with repulsion between layers. `start` replaces the scene's start.
[[nodiscard]] Drape drape_cloth(const DrapeCase& drape, const DrapeOptions& options,
                                const StartVariation& variation = {},
                                const DrapeProgress& progress = {}, const DrapeStart& start = {});

/// Continues from a rest on a coarser mesh, as drape_cloth() does from its coarsest.
[[nodiscard]] Drape polished(const DrapeCase& drape, const DrapeOptions& options,
                             std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest);

}  // namespace drape::simulate

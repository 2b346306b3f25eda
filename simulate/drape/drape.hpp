// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simulate/drape/level.hpp"

namespace drape::simulate {

/// Result of one mesh of a drape.
struct LevelReport {
  double spacing_m = 0;
  int points = 0;
  RestReport rest;
  /// Mean distance of the print's marks from the next coarser mesh; absent on the coarsest.
  std::optional<double> moved_m;
};

/// A cloth from its start to rest on the finest mesh.
struct Drape {
  std::shared_ptr<DrapeLevel> level;  ///< the finest
  ClothMoment rest;
  std::vector<LevelReport> levels;  ///< from coarse to fine; the drape ends with the last
  /// Places of the print's marks on each level (local frame), one row each, in the order of
  /// `marks`.
  std::vector<Eigen::MatrixX3d> marks_of_level;
  std::vector<MarkId> marks;
  /// Distance (m) of each mark from where a mesh without end would have it; empty of one level.
  /// With d its distance between the last two levels and r by how much the mean of d shrank from
  /// the level before: 1.25 d / (r - 1) (grid convergence index: Roache 1994), r within 2 and 4,
  /// for contact and bending converge as spacing^2; or 3 where points are held, beside which the
  /// stretch grows with the logarithm of the spacing, at first hidden under the rest. Of two levels
  /// alone, whose r is not known, 3 d / (r - 1) with r = 4, or 2 where points are held. d is at
  /// least half the mean over the marks: a mark may cross its limit.
  Eigen::VectorXd mesh_error_m;
  std::vector<std::string> warnings;

  [[nodiscard]] bool at_rest() const { return levels.back().rest.at_rest; }
};

/// Start of a cloth on the coarsest mesh, in place of DrapeLevel::start().
using DrapeStart = std::function<ClothMoment(const DrapeLevel& level)>;

/// Called with the fraction of the work that is done.
using DrapeProgress = std::function<void(double fraction)>;

/// Drapes a cloth in nested levels: a fall in time on the coarsest mesh, then shape, friction and
/// memory carried to each finer mesh and taken down to rest there. A start from the measured shape
/// and a cloth with a history begin as start.hpp says. A cloth that passes through itself is draped
/// again from the same start with its layers apart. `start`: another start than the scene's.
[[nodiscard]] Drape drape_cloth(const DrapeCase& drape, const DrapeOptions& options,
                                const StartVariation& variation = {},
                                const DrapeProgress& progress = {}, const DrapeStart& start = {});

/// Goes on from a rest on a coarser mesh, as drape_cloth() does from its coarsest.
[[nodiscard]] Drape polished(const DrapeCase& drape, const DrapeOptions& options,
                             std::shared_ptr<DrapeLevel> coarse, const ClothMoment& rest);

}  // namespace drape::simulate

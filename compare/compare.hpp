// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "compare/drape_report.hpp"

namespace drape::compare {

/// Requirements on a comparison.
struct Options {
  int min_marks = 10;             ///< the paper used 10 to 36 marks (section 5)
  double max_sigma_ratio = 0.1;   ///< largest median sigma of a mark per best mean distance
  bool accept_unsettled = false;  ///< accept simulations that are not at rest
  std::optional<double> tolerance_m = {};  ///< limit of the match below three repeats
  double significance = 0.05;  ///< probability that a real repeat counts as outside the others
};

/// Distances of the measured marks, and of the surface between them, from a mesh.
[[nodiscard]] RealSurface compare_to_surface(const Sheet& measured, const TriangleMesh& mesh);

[[nodiscard]] Measurement measurement_of(const Sheet& sheet);

/// Compares one drape: distances between each measured mark and the same material point of each
/// simulation, and, between simulations, the pairs in the paper's tables only: 5 against 1 segments
/// at grids 11, 21 and 31; grids 11 against 21 at 1 and at 5 segments; 11 against 31 and 21 against
/// 31 at 5 segments (Bottino, Laurentini & Scalabrin, section 5). Throws Error(bad_input) for
/// sheets of different patches or scenes and for a simulation given twice.
[[nodiscard]] Report compare_drape(const DrapeInput& input, const Options& options);

/// Compares the paper's pairs among the simulations at the particles of their coarsest grid. Throws
/// like compare_drape.
[[nodiscard]] VirtualGroup compare_virtual_group(std::vector<Simulation> simulations);

/// A length in percent of the patch's (warp, weft) side.
[[nodiscard]] Eigen::Vector2d percent_of_patch(double length_m, const Eigen::Vector2d& patch_m);

}  // namespace drape::compare

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>

#include "compare/compare.hpp"

namespace drape::compare {

/// `report` has a headline here and below.
[[nodiscard]] const RealVirtual& headline_of(const Report& report);
/// The headline, or the fall that a refined one began with; nothing where that is not given.
[[nodiscard]] const RealVirtual* fall_of(const DrapeInput& input, const Report& report);
/// The simulation that differs from the fall in nothing but its grid, the next coarser; or in
/// nothing but its segments. `below`: only grids with fewer rows.
[[nodiscard]] const RealVirtual* neighbour_of(const DrapeInput& input, const Report& report,
                                              bool other_grid,
                                              int below = std::numeric_limits<int>::max());
/// Virtual places of the headline's marks on another simulation (m, world); nothing where one has
/// no place.
[[nodiscard]] std::optional<Eigen::MatrixX3d> places_on(const RealVirtual& other,
                                                        const RealVirtual& headline);

/// Error that the headline's grid leaves, as drape-simulate refine states it where that made the
/// headline, else by the next two coarser ones (Richardson 1911). The latter holds where all three
/// end on one branch, no farther apart than the ensemble's members are linked by, and where the
/// marks' displacements fall from grid to grid as an error of order 1 to 3 does. An order above 2,
/// the model's own, is not relied on.
struct GridError {
  std::string coarser;            ///< "21x21, 5 segments"
  double apart_m = 0;             ///< mean over the marks
  std::optional<double> reach_m;  ///< reach of the ensemble's branches; absent: no ensemble
  std::string coarsest;           ///< coarsest of the three; empty: there are two
  double below_m = 0;             ///< between the two coarser ones, mean over the marks
  std::optional<double> order;    ///< order that the three show; absent: not 1 to 3
  std::optional<double> left_m;   ///< mean over the marks; absent: not known
  std::string refined;            ///< sentence of drape-simulate refine, where it made the headline
};
[[nodiscard]] std::optional<GridError> grid_error_of(const DrapeInput& input, const Report& report);
/// For people, without a full stop.
[[nodiscard]] std::string grid_sentence(const GridError& error);

}  // namespace drape::compare

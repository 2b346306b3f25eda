// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/files/json_file.hpp"
#include "core/rig.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"
#include "simulate/simulate.hpp"

namespace drape::simulate {

inline constexpr double kModelOrder = 2;  ///< by which the cloth's elements converge

struct RefineOptions {
  int finest = 61;  ///< particles along the longer side, at most
  /// Error that the grid may leave, mean over the marks; then no finer one
  double goal_m = 0.5e-3;

  /// Throws Error(usage) for a value that cannot be refined to.
  void check() const;
};

/// A sheet at rest that finer grids go on from.
struct Rest {
  Sheet sheet;  ///< in the world, every particle there
  /// Forces that friction holds there; empty: nothing known
  std::vector<ContactForce> contact_forces;
};

/// The rest on one of the finer grids.
struct RefinedGrid {
  SimulateResult result;      ///< judged by the checker
  Eigen::MatrixX3d places_m;  ///< places of the print's marks
  std::optional<double>
      apart_m;  ///< mean over the marks, from the grid before; absent: no whole sheet
  [[nodiscard]] bool at_rest() const { return result.report.status == RestStatus::at_rest; }
};

/// Difference of a grid from one without end.
struct GridLeft {
  std::optional<double> order;  ///< that three grids show; absent: none of 1 to 3
  /// From the finest grid to that limit, by mark; without an order at most so far, to either side.
  Eigen::MatrixX3d moves_m;
  [[nodiscard]] double mean_m() const { return moves_m.rowwise().norm().mean(); }
};

/// Refinement of one rest, on its branch.
struct Refinement {
  double goal_m = 0;  ///< that was asked for
  GridSpec coarse;
  Eigen::MatrixX3d coarse_places_m;
  std::vector<RefinedGrid> grids;  ///< from coarse to fine; the last may have come to no rest
  std::optional<GridLeft> left;    ///< report of the finest grid at rest; absent: none is
  /// Index of that grid.
  [[nodiscard]] std::optional<std::size_t> finest_at_rest() const;
};

/// Places at the marks of three grids of these spacings, from fine to coarse, give what the finest
/// leaves (Richardson 1911). The order is that of the displacements' projections on each other; one
/// of 1 to 3 is believed, and of one above 2, the model's own, 2 is relied on (as Roache 1994). Of
/// no order the error is taken to fall by the first only.
[[nodiscard]] GridLeft left_of(const std::array<double, 3>& spacing_m,
                               const std::array<const Eigen::MatrixX3d*, 3>& places_m);
/// The same from two grids, which show no order.
[[nodiscard]] GridLeft left_of(double fine_spacing_m, double coarse_spacing_m,
                               const Eigen::MatrixX3d& fine_m, const Eigen::MatrixX3d& coarse_m);

/// Grids after `coarse`: each has the square root of two times as many cells along a side as the
/// one before, up to `finest` particles.
[[nodiscard]] std::vector<GridSpec> refined_grids(const GridSpec& coarse, int finest);

/// Places of the print's marks on a sheet that is whole, interpolated by cubics.
[[nodiscard]] Eigen::MatrixX3d places_of_marks(const Sheet& sheet, const Print& print);

/// Carries a rest over to finer grids, one after the other, and lets the static solver take it to
/// rest on each, so that all stay on one branch. It ends where the grid leaves less than the goal,
/// at the finest grid, or at the first that comes to no rest. `options`: what the rest was made
/// with. Throws Error for wrong input, also for a cloth with internal friction: its memory belongs
/// to its grid.
[[nodiscard]] Refinement refine(const Scene& scene, const Fabric& fabric, const Print& print,
                                const std::optional<Sheet>& measured,
                                const SimulateOptions& options, const Rest& rest,
                                const RefineOptions& how);

/// "61x61": where the files of that grid lie, in the folder of refinement.json.
[[nodiscard]] std::string folder_of(const RefinedGrid& grid);

/// refinement.json (schema drapebench/refinement/1). `rest_sha256`: of sheet.json of the rest;
/// `folder` holds the sheets, which are written.
[[nodiscard]] Json refinement_json(const Refinement& refinement, const Print& print,
                                   const RefineOptions& how, const std::string& rest_sha256,
                                   const std::filesystem::path& folder);

/// Sentence about the error that the grid leaves, for people, without a full stop.
[[nodiscard]] std::string left_sentence(const Refinement& refinement);

}  // namespace drape::simulate

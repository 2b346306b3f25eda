// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "compare/metrics/surface.hpp"
#include "core/branch_list.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

/// One of several equilibria of a drape.
struct Branch {
  std::string set_sha256;              ///< hash of the branches.json that lists all of them
  int number = 0;                      ///< rank by energy, 1 is the lowest
  int of = 0;                          ///< number of equilibria found
  double energy_j = 0;                 ///< only differences within one list are meaningful
  double residual = 0;                 ///< largest net force, in weights of a particle
  bool stable = true;                  ///< false at a saddle point of the energy
  int starts = 0;                      ///< number of starts that ended here
  int hem_nodes = 0;                   ///< number of folds along the hem
  bool round = false;                  ///< true if the scene is symmetric about a vertical axis
  std::optional<double> share = {};    ///< fraction of the seeded starts
  std::optional<double> least_j = {};  ///< energy of the lowest in its list, given or not
};

/// The entry for this sheet in branches.json in the folder above the sheet's, and that file;
/// nullopt if there is none. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<std::pair<std::filesystem::path, Branch>> branch_of(
    const std::filesystem::path& sheet);

/// The entry with that number in a list; nullopt if there is none.
[[nodiscard]] std::optional<Branch> branch_in(const Document& list, int number);

/// The list in the folder above a branch's sheet, if it still has the hash stated.
[[nodiscard]] std::optional<BranchList> list_above(const std::filesystem::path& sheet,
                                                   const std::string& sha256);

/// Summaries for people, without a full stop.
[[nodiscard]] std::string ensemble_sentence(const BranchList& list);
[[nodiscard]] std::string friction_sentence(const FrictionBand& band);
[[nodiscard]] std::string memory_sentence(const MemoryBand& band);

/// Base of the vertical axis of a round scene on the table: the centre of its first object.
[[nodiscard]] std::optional<Eigen::Vector2d> axis_of(const Scene& scene);

/// Mean distance after the rotation about a vertical axis that minimises it. On a round object a
/// rotated equilibrium is the same one, so only this distance shows which one the cloth took.
struct TurnedDistance {
  double mean_m = 0;
  double turn_rad = 0;     ///< rotation of the virtual sheet, from x to y
  bool half_turn = false;  ///< true if the sheet is also turned by half a turn in its own plane
  Eigen::Vector2d axis_in_world = Eigen::Vector2d::Zero();
};

/// Tries rotations in steps of one degree, with the sheet as it is and with every material point
/// exchanged with the opposite one; then refines the best by golden section. nullopt if no mark has
/// a position on the virtual sheet.
[[nodiscard]] std::optional<TurnedDistance> best_turn(const Sheet& measured,
                                                      const Surface& virtual_sheet,
                                                      const Eigen::Vector2d& axis_in_world);

}  // namespace drape::compare

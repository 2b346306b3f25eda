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

/// One equilibrium of a drape that has several.
struct Branch {
  std::string set_sha256;              ///< hash of branches.json, which lists all of them
  int number = 0;                      ///< 1 has the least energy
  int of = 0;                          ///< equilibria that were found
  double energy_j = 0;                 ///< only differences within one list mean anything
  double residual = 0;                 ///< largest, in weights of a particle
  bool stable = true;                  ///< false: a saddle
  int starts = 0;                      ///< number of starts that ended here
  int hem_nodes = 0;                   ///< folds of the border
  bool round = false;                  ///< the scene looks the same turned about a vertical axis
  std::optional<double> share = {};    ///< of the seeded starts
  std::optional<double> least_j = {};  ///< energy of the first of its list, given or not
};

/// The entry for this sheet of branches.json in the folder above the sheet's, and that list's file;
/// nothing when there is none. Throws Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<std::pair<std::filesystem::path, Branch>> branch_of(
    const std::filesystem::path& sheet);

/// The entry of that number in a list; nothing when it has none.
[[nodiscard]] std::optional<Branch> branch_in(const Document& list, int number);

/// The list in the folder above a branch's sheet, while it has these bytes.
[[nodiscard]] std::optional<BranchList> list_above(const std::filesystem::path& sheet,
                                                   const std::string& sha256);

/// Summaries for people, without a full stop.
[[nodiscard]] std::string ensemble_sentence(const BranchList& list);
[[nodiscard]] std::string friction_sentence(const FrictionBand& band);
[[nodiscard]] std::string memory_sentence(const MemoryBand& band);

/// Foot of the vertical axis of a round scene on the table: the middle of its first object.
[[nodiscard]] std::optional<Eigen::Vector2d> axis_of(const Scene& scene);

/// Mean distance after the turn about a vertical axis that makes it smallest. On a round object an
/// equilibrium turned is the same equilibrium, so only this distance says which one the cloth took.
struct TurnedDistance {
  double mean_m = 0;
  double turn_rad = 0;     ///< turn of the virtual sheet, from x to y
  bool half_turn = false;  ///< the sheet turned by half a turn in its own plane as well
  Eigen::Vector2d axis_in_world = Eigen::Vector2d::Zero();
};

/// All turns at one degree are tried, with the sheet as it is and with every material point in the
/// place of the one opposite; then the best is refined by golden section. Nothing when no mark has
/// a place on the virtual sheet.
[[nodiscard]] std::optional<TurnedDistance> best_turn(const Sheet& measured,
                                                      const Surface& virtual_sheet,
                                                      const Eigen::Vector2d& axis_in_world);

}  // namespace drape::compare

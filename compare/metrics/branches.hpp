// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "compare/metrics/surface.hpp"
#include "core/files/json_file.hpp"
#include "core/scene.hpp"
#include "core/sheet.hpp"

namespace drape::compare {

inline constexpr int kBranchesVersion = 1;  ///< of branches.json

/// What drape-simulate branches says of one equilibrium of a drape that has several.
struct Branch {
  std::string set_sha256;              ///< of branches.json, which lists all of them
  int number = 0;                      ///< 1 has the least energy
  int of = 0;                          ///< equilibria that were found
  double energy_j = 0;                 ///< only differences within one list mean anything
  double residual = 0;                 ///< largest, in weights of a particle
  bool stable = true;                  ///< false: a saddle
  int starts = 0;                      ///< how many starts ended here
  int hem_nodes = 0;                   ///< folds of the border
  bool round = false;                  ///< the scene looks the same turned about a vertical axis
  std::optional<double> least_j = {};  ///< energy of the first of its list, given or not
};

/// branches.json ("drapebench/branches/1") in the folder above the sheet's, and its entry for this
/// sheet; nothing when there is no such list or it does not name the sheet. Throws Error(bad_input)
/// for a list that cannot be read.
struct ListedBranch {
  std::filesystem::path list;
  Branch branch;
};
[[nodiscard]] std::optional<ListedBranch> branch_of(const std::filesystem::path& sheet);

/// The entry of that number in a list, wherever the list lies; nothing when it has none.
[[nodiscard]] std::optional<Branch> branch_in(const std::filesystem::path& list, int number);

/// The list while it is the one of this hash and has that part; else nothing. Throws
/// Error(bad_input) for a list that cannot be read.
[[nodiscard]] std::optional<JsonNode> list_with(const std::string& part,
                                                const std::filesystem::path& list,
                                                const std::string& sha256);

/// "moves_mm" of an end of an interval, in m, one row a mark; nothing for an end that counts for
/// nothing.
[[nodiscard]] std::optional<Eigen::MatrixX3d> moves_m_of(const JsonNode& end, std::size_t marks);

/// Where the vertical axis of a round scene meets the table: the middle of its first object.
[[nodiscard]] std::optional<Eigen::Vector2d> axis_of(const Scene& scene);

/// Mean distance after the turn about a vertical axis that makes it smallest. On a round object an
/// equilibrium turned is the same equilibrium, so only this distance says which one the cloth took.
struct TurnedDistance {
  double mean_m = 0;
  double turn_rad = 0;     ///< of the virtual sheet, from x to y
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

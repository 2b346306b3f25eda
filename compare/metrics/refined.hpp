// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/marks.hpp"

namespace drape::compare {

inline constexpr int kRefinementVersion = 1;  ///< of refinement.json

/// What drape-simulate refine says of a drape that was carried over from a coarser grid.
struct Refined {
  std::string list_sha256;  ///< of refinement.json
  std::string rest_sha256;  ///< of the .json of the sheet that it began with
  /// Of the finest grid that came to rest only; the others state nothing.
  std::optional<double> left_m;  ///< that the grid may leave, mean over the marks
  std::optional<double> order;   ///< that three grids show
  double goal_m = 0;             ///< that was asked for
  std::string sentence = {};     ///< for people
  std::vector<MarkId> marks = {};
  Eigen::MatrixX3d places_m = {};  ///< of the marks, in the world
  Eigen::MatrixX3d moves_m = {};   ///< that the grid may leave of each, to either side
};

/// refinement.json ("drapebench/refinement/1") in the folder above the sheet's, and its entry for
/// this sheet; nothing when there is no such list or it does not name the sheet. Throws
/// Error(bad_input) for a list that cannot be read.
struct ListedRefined {
  std::filesystem::path list;
  Refined refined;
};
[[nodiscard]] std::optional<ListedRefined> refined_of(const std::filesystem::path& sheet);

}  // namespace drape::compare

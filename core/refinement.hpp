// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One grid that a drape was carried over to.
struct RefinedGrid {
  int rows = 0, cols = 0;
  std::string sheet;         ///< path from the folder of the list
  std::string sheet_sha256;  ///< SHA-256 of its sheet.json
  bool at_rest = false;      ///< and accepted by the checker
  std::string status;
  int steps = 0;
  std::optional<double> from_coarser_m;  ///< mean distance of the marks; absent: not whole
};

/// Place of a mark on the grid used, and the way from there to a grid without end.
struct RefinedMark {
  MarkId mark;
  Eigen::Vector3d place_in_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d left_m = Eigen::Vector3d::Zero();  ///< without an order at most so far
};

/// refinement.json: a drape carried over to finer grids, and what the finest leaves to a grid
/// without end.
struct RefinementFile {
  std::string rest_sha256;         ///< SHA-256 of sheet.json of the drape that it began with
  int finest_allowed = 5;          ///< particles along the longer side
  double goal_m = 0;               ///< no finer grid was tried where one leaves less
  std::vector<RefinedGrid> grids;  ///< from coarse to fine
  std::optional<int> used;         ///< index of the finest grid at rest
  std::optional<double> order;     ///< that three grids show
  std::optional<double> left_m;    ///< mean over the marks
  std::string sentence;
  std::vector<RefinedMark> marks;
  Document document;
};
template <>
inline constexpr Format format_of<RefinementFile>{
    "refinement", Syntax::json, 1, "refinement.json: a drape carried over to finer grids."};

void fields(Fields& f, RefinementFile& file);

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One mesh of a drape in nested levels.
struct DrapeLevelRecord {
  double spacing_m = 0;
  int points = 0;
  bool at_rest = false;
  std::string status;  ///< "at rest", or why not
  int steps = 0;
  std::optional<double> from_coarser_m;  ///< mean distance of the marks; absent on the coarsest
};

/// Place of a mark on the finest mesh, and the error that this mesh may leave there.
struct LevelMark {
  MarkId mark;
  Eigen::Vector3d place_in_world = Eigen::Vector3d::Zero();
  double left_m = 0;  ///< largest distance from the limit of ever finer meshes
  std::optional<Eigen::Vector3d> from_coarser_m;  ///< move from the next coarser mesh, in the world
};

/// levels.json: the meshes of a drape from coarse to fine, and the error that the finest may leave.
/// It lies beside its sheet.
struct LevelsFile {
  std::string sheet_sha256;  ///< SHA-256 of the sheet.json beside it
  std::vector<DrapeLevelRecord> levels;
  std::optional<double> left_m;  ///< mean over the marks; absent: not at rest, or one level alone
  std::vector<LevelMark> marks;
  Document document = {};
};
template <>
inline constexpr Format format_of<LevelsFile>{
    "levels", Syntax::json, 1,
    "levels.json: the meshes of a drape, and the error that the finest may leave."};

void fields(Fields& f, LevelsFile& file);

/// "mesh error up to 0.125 mm in the mean of the marks; `--spacing-mm 1.25` lowers it", or why none
/// is known.
[[nodiscard]] std::string mesh_error_sentence(const LevelsFile& file);

}  // namespace drape

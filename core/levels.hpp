// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/fields/records.hpp"
#include "core/marks.hpp"

namespace drape {

/// One mesh in the hierarchy of nested levels of a drape.
struct DrapeLevelRecord {
  double spacing_m = 0;
  int points = 0;
  bool at_rest = false;
  std::string status;  ///< "at rest", or why not
  int steps = 0;
  std::optional<double> from_coarser_m;  ///< mean move from the next coarser mesh; absent on it
};

/// Position of a mark on the finest mesh, with a bound on its remaining mesh error.
struct LevelMark {
  MarkId mark;
  Eigen::Vector3d place_in_world = Eigen::Vector3d::Zero();
  double left_m = 0;  ///< largest distance from the limit of infinite mesh refinement
  std::optional<Eigen::Vector3d> from_coarser_m;  ///< displacement from the next coarser mesh
};

/// levels.json: the meshes of a drape from coarse to fine, with the remaining error of the finest.
/// It lies beside the drape's sheet.
struct LevelsFile {
  std::string sheet_sha256;  ///< SHA-256 of the sheet.json beside it
  std::vector<DrapeLevelRecord> levels;
  std::optional<double> left_m;  ///< mean over the marks; absent if not at rest or with one level
  std::vector<LevelMark> marks;
  Document document = {};
};
template <>
inline constexpr Format format_of<LevelsFile>{
    "levels", Syntax::json, 1,
    "levels.json: the meshes of a drape, and the error that the finest may leave."};

void fields(Fields& f, LevelsFile& file);

/// Sentence such as "mesh error up to 0.125 mm in the mean of the marks; `--spacing-mm 1.25` lowers
/// it", or the reason why the error is unknown.
[[nodiscard]] std::string mesh_error_sentence(const LevelsFile& file);

}  // namespace drape

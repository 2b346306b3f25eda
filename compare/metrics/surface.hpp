// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

/// A point of a sheet with its local frame; world frame, metres.
struct SurfacePoint {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d along_warp;  ///< unit tangent in the direction of increasing rows
  Eigen::Vector3d along_weft;  ///< unit tangent in the direction of increasing columns
  Eigen::Vector3d normal;      ///< unit normal on the printed side: warp cross weft
};

/// A sheet as a surface over material coordinates: bilinear on each cell of the particle grid. The
/// warp coordinate must depend on the row only and the weft coordinate on the column only.
class Surface {
 public:
  /// `file` names the sheet in errors. Throws Error(bad_input) if the points do not form a grid or
  /// there are fewer than 2x2.
  Surface(const Sheet& sheet, const std::string& file);

  /// nullopt outside the grid (1 nm tolerance), in a cell with a missing corner, or if the cell is
  /// degenerate and has no normal.
  [[nodiscard]] std::optional<SurfacePoint> at(const Eigen::Vector2d& material_m) const;

 private:
  [[nodiscard]] const std::optional<Eigen::Vector3d>& point(std::size_t row, std::size_t col) const;

  std::vector<double> warp_m_;  ///< material coordinate of each row
  std::vector<double> weft_m_;  ///< material coordinate of each column
  std::vector<std::optional<Eigen::Vector3d>> points_;
};

/// Material coordinates of every mark of a lattice, including gaps, derived from the marks that
/// have a position: the coordinates are linear in row and column. nullopt if fewer than two rows or
/// columns are measured. Throws Error(bad_input) if the marks are not on such a lattice.
class LatticeCoordinates {
 public:
  [[nodiscard]] static std::optional<LatticeCoordinates> of(const Sheet& sheet,
                                                            const std::string& file);
  [[nodiscard]] Eigen::Vector2d at(MarkId mark) const;

 private:
  Eigen::Vector2d origin_m_ = Eigen::Vector2d::Zero();
  Eigen::Vector2d pitch_m_ = Eigen::Vector2d::Zero();
};

}  // namespace drape::compare

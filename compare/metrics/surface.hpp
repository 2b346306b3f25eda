// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

/// A point of a sheet and its local frame; world frame, metres.
struct SurfacePoint {
  Eigen::Vector3d point_in_world;
  Eigen::Vector3d along_warp;  ///< unit tangent in the direction of growing rows
  Eigen::Vector3d along_weft;  ///< unit tangent in the direction of growing columns
  Eigen::Vector3d normal;      ///< unit, out of the printed side: warp cross weft
};

/// A sheet as a surface over its material coordinates: bilinear on each cell of the particle grid.
/// The warp coordinate must depend on the row alone and the weft coordinate on the column alone.
class Surface {
 public:
  /// `file` names the sheet in errors. Throws Error(bad_input) when the points do not form a grid
  /// or fewer than 2x2 of them exist.
  Surface(const Sheet& sheet, const std::string& file);

  /// Empty outside the grid (1 nm tolerance), in a cell with a missing corner, or where the
  /// cell has collapsed to a line so that it has no normal.
  [[nodiscard]] std::optional<SurfacePoint> at(const Eigen::Vector2d& material_m) const;

 private:
  [[nodiscard]] const std::optional<Eigen::Vector3d>& point(std::size_t row, std::size_t col) const;

  std::vector<double> warp_m_;  ///< material coordinate of each row
  std::vector<double> weft_m_;  ///< material coordinate of each column
  std::vector<std::optional<Eigen::Vector3d>> points_;
};

/// Material coordinates of every mark of a lattice, gaps included, found from the marks that have
/// a position: the two coordinates are linear in row and column. Nothing when fewer than two rows
/// or two columns are measured. Throws Error(bad_input) when the marks are not on such a lattice.
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

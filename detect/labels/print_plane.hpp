// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "core/marks.hpp"
#include "core/rig.hpp"

namespace drape::detect {

/// Print on a flat surface, cloth or target, in one plane frame: x along the columns, y along the
/// rows, metres. Seen from the printed side the frame is right-handed for a target (y up) and
/// left-handed for a cloth (y down).
struct PrintPlane {
  int rows = 0, cols = 0;
  double pitch_m = 0;
  double dot_radius_m = 0;
  Eigen::Vector2d first_m = Eigen::Vector2d::Zero();  ///< position of mark (0, 0)
  std::string tag_family;
  double tag_edge_m = 0;
  double row_sign = 1;  ///< +1 if rows run down with upright tags (cloth), -1 if up (target)
  std::optional<DotClasses> classes;
  bool stiff = false;                   ///< a plate rather than cloth
  bool white_dots = false;              ///< on a black plate
  bool staggered = false;               ///< dots only where row + col is even
  std::map<int, Eigen::Vector2d> tags;  ///< centre by id

  [[nodiscard]] Eigen::Vector2d point_m(MarkId mark) const;
  /// Centre of the cell between a mark and the one in the next row and column.
  [[nodiscard]] Eigen::Vector2d cell_centre_m(MarkId upper_left) const {
    return point_m(upper_left) + 0.5 * pitch_m * Eigen::Vector2d::Ones();
  }
  [[nodiscard]] bool contains(MarkId mark) const;
  /// Corners of an upright tag: upper left, upper right, lower right, lower left.
  [[nodiscard]] std::array<Eigen::Vector2d, 4> tag_corners_m(int id) const;
  /// Marks around a tag: at most 0.75 pitch away along both axes.
  [[nodiscard]] std::vector<MarkId> marks_around(int id) const;
  /// True if the centre of a tag lies in the cell between (row, col) and (row + 1, col + 1).
  [[nodiscard]] bool has_tag_in_cell(MarkId upper_left) const;
  /// Radius of the light centre that some dots have, in radii of the dot; 0 if none has.
  [[nodiscard]] double light_centre_fraction() const;
};

[[nodiscard]] PrintPlane plane_of(const Target& target);
[[nodiscard]] PrintPlane plane_of(const Print& print);

}  // namespace drape::detect

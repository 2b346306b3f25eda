// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

namespace drape::detect {

/// Where the points of a cell between four dots are seen: the unit square, corners (0, 0), (1, 0),
/// (1, 1), (0, 1), to pixels.
class CellMap {
 public:
  /// The projective map of a flat cell (Heckbert 1989); nothing for corners that are no view of a
  /// square.
  static std::optional<CellMap> flat(const std::array<Eigen::Vector2d, 4>& corners_px);

  /// A patch (Coons 1967) between four cubic edges, whose ends run as the dots' ellipses say.
  /// `roots_px` are the ellipses' symmetric roots in px per pitch.
  static std::optional<CellMap> bent(const std::array<Eigen::Vector2d, 4>& corners_px,
                                     const std::array<Eigen::Matrix2d, 4>& roots_px);

  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& at) const;

 private:
  [[nodiscard]] Eigen::Vector2d bent_at(double x, double y) const;

  bool bent_ = false;
  std::array<Eigen::Vector2d, 4> corners_;
  std::array<Eigen::Matrix2d, 4> maps_;  ///< px per side at the corners
  Eigen::Matrix<double, 2, 3> h_;
  Eigen::Vector2d gh_;
};

}  // namespace drape::detect

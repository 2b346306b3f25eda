// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/rig.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// Corners of a chessboard, or of a rectangle of it, by row and column; rows run up when columns
/// run right, as one sees the printed face (core/rig.hpp).
struct BoardGrid {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> px;
  int first_row = 0, first_col = 0;  ///< of the target

  [[nodiscard]] const Eigen::Vector2d& at(int row, int col) const {
    return px[static_cast<std::size_t>(row) * cols + col];
  }
  /// Place `row`, `col` in the pattern, in or beside the grid, by its two nearest corners along
  /// either axis.
  [[nodiscard]] Eigen::Vector2d near(double row, double col) const;
  [[nodiscard]] double nearest_neighbour_px(int row, int col) const;
  /// Whether every corner lies where its neighbours to both sides let one expect it: a third of
  /// their distance is more than perspective and lens bend, and less than a wrong corner is off.
  [[nodiscard]] bool is_regular() const;

  /// Turned by a quarter: the last row becomes the first column.
  [[nodiscard]] BoardGrid turned() const;
  /// Makes rows run up when columns run right.
  void unmirror();
};

/// How much brighter the squares with even row + col are than the others, grey levels.
[[nodiscard]] double even_over_odd(const GreyImage& image, const BoardGrid& grid);

/// Gives a rectangle of corners its place on the board: an axis that is not whole must show one of
/// the board's two ends, behind whose last squares the light rim runs. Nothing where no place or
/// more than one agrees with what is seen.
[[nodiscard]] std::optional<BoardGrid> placed_on_board(const GreyImage& image, const Target& target,
                                                       const BoardGrid& part);

}  // namespace drape::detect

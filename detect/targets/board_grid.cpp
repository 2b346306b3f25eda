// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/board_grid.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace drape::detect {
namespace {

using Eigen::Vector2d;

/// Of the board's contrast: squares alternate by at least so much, the rim by at most so much.
constexpr double kSquares = 0.5, kRim = 0.25;

std::optional<double> level_near(const GreyImage& image, const Vector2d& px) {
  const long x = std::lround(px.x()), y = std::lround(px.y());
  if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) return std::nullopt;
  return image.level(static_cast<int>(x), static_cast<int>(y));
}

/// Levels of the squares `beyond` pitches outside one side, from its one end to the other.
std::optional<std::vector<double>> squares_beyond(const GreyImage& image, const BoardGrid& grid,
                                                  bool along_rows, bool high, double beyond) {
  std::vector<double> levels;
  const int squares = (along_rows ? grid.rows : grid.cols) - 1;
  const double across = high ? (along_rows ? grid.cols : grid.rows) - 1 + beyond : -beyond;
  for (int i = 0; i < squares; ++i) {
    const auto level =
        level_near(image, along_rows ? grid.near(i + 0.5, across) : grid.near(across, i + 0.5));
    if (!level) return std::nullopt;
    levels.push_back(*level);
  }
  return levels;
}

/// Mean difference of neighbours with alternating sign.
double alternation(const std::vector<double>& levels) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i)
    sum += (i % 2 == 0 ? 1 : -1) * (levels[i] - levels[i + 1]);
  return std::abs(sum) / static_cast<double>(levels.size() - 1);
}

/// Whether the board ends beyond one side of the grid: one more row of squares, then a light rim.
bool ends(const GreyImage& image, const BoardGrid& grid, bool along_rows, bool high,
          double contrast) {
  const auto squares = squares_beyond(image, grid, along_rows, high, 0.5);
  const auto rim = squares_beyond(image, grid, along_rows, high, 1.4);
  if (!squares || !rim || alternation(*squares) < kSquares * contrast ||
      alternation(*rim) > kRim * contrast)
    return false;
  const auto [dark, light] = std::minmax_element(squares->begin(), squares->end());
  return *std::min_element(rim->begin(), rim->end()) > (*dark + *light) / 2;
}

/// First row or column on the board of an axis of `seen` of its `whole` corners.
std::optional<int> first_of(int seen, int whole, bool low_end, bool high_end) {
  if (seen == whole) return 0;
  if (seen > whole || low_end == high_end) return std::nullopt;
  return low_end ? 0 : whole - seen;
}

}  // namespace

Vector2d BoardGrid::near(double row, double col) const {
  const int r = std::clamp(static_cast<int>(std::floor(row)), 0, rows - 2);
  const int c = std::clamp(static_cast<int>(std::floor(col)), 0, cols - 2);
  // Projective in the four corners: squares beyond a slanted board's end grow or shrink.
  const Vector2d a = at(r, c), b = at(r, c + 1), d = at(r + 1, c), e = at(r + 1, c + 1);
  Eigen::Matrix2d sides;
  sides << b - e, d - e;
  const Vector2d gh = sides.inverse() * (a - b - d + e);
  const double u = col - c, v = row - r;
  const double g = gh.x(), h = gh.y();
  const Vector2d along = b * (1 + g) - a, across = d * (1 + h) - a;
  return (a + u * along + v * across) / (1 + g * u + h * v);
}

double BoardGrid::nearest_neighbour_px(int row, int col) const {
  double nearest = std::numeric_limits<double>::infinity();
  const auto look = [&](int r, int c) {
    if (r < 0 || c < 0 || r >= rows || c >= cols) return;
    nearest = std::min(nearest, (at(r, c) - at(row, col)).norm());
  };
  look(row - 1, col);
  look(row + 1, col);
  look(row, col - 1);
  look(row, col + 1);
  return nearest;
}

bool BoardGrid::is_regular() const {
  const auto bends = [](const Vector2d& before, const Vector2d& here, const Vector2d& after) {
    return ((before + after) / 2 - here).norm() > (after - before).norm() / 6;
  };
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      if (row > 0 && row + 1 < rows && bends(at(row - 1, col), at(row, col), at(row + 1, col)))
        return false;
      if (col > 0 && col + 1 < cols && bends(at(row, col - 1), at(row, col), at(row, col + 1)))
        return false;
    }
  }
  return true;
}

BoardGrid BoardGrid::turned() const {
  BoardGrid result{cols, rows, {}, 0, 0};
  for (int row = 0; row < cols; ++row)
    for (int col = 0; col < rows; ++col) result.px.push_back(at(rows - 1 - col, row));
  return result;
}

void BoardGrid::unmirror() {
  const Vector2d along_cols = at(0, cols - 1) - at(0, 0);
  const Vector2d along_rows = at(rows - 1, 0) - at(0, 0);
  if (along_cols.x() * along_rows.y() - along_cols.y() * along_rows.x() < 0) return;
  const BoardGrid old = *this;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col)
      px[static_cast<std::size_t>(row) * cols + col] = old.at(rows - 1 - row, col);
}

double even_over_odd(const GreyImage& image, const BoardGrid& grid) {
  double sums[2] = {0, 0};
  int counts[2] = {0, 0};
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int col = 0; col + 1 < grid.cols; ++col) {
      const Vector2d middle = (grid.at(row, col) + grid.at(row + 1, col) + grid.at(row, col + 1) +
                               grid.at(row + 1, col + 1)) /
                              4;
      const int parity = (grid.first_row + row + grid.first_col + col) % 2;
      sums[parity] += image.level(static_cast<int>(std::lround(middle.x())),
                                  static_cast<int>(std::lround(middle.y())));
      ++counts[parity];
    }
  }
  return sums[0] / counts[0] - sums[1] / counts[1];
}

std::optional<BoardGrid> placed_on_board(const GreyImage& image, const Target& target,
                                         const BoardGrid& part) {
  const double contrast = std::abs(even_over_odd(image, part));
  std::optional<BoardGrid> placed;
  BoardGrid grid = part;
  for (int quarter = 0; quarter < 4; ++quarter, grid = grid.turned()) {
    grid.first_row = grid.first_col = 0;
    const auto end = [&](bool along_rows, bool high) {
      return ends(image, grid, along_rows, high, contrast);
    };
    const auto row = first_of(grid.rows, target.rows, end(false, false), end(false, true));
    const auto col = first_of(grid.cols, target.cols, end(true, false), end(true, true));
    if (!row || !col) continue;
    grid.first_row = *row;
    grid.first_col = *col;
    // The square inside corner (0, 0) is dark.
    if (even_over_odd(image, grid) > 0) continue;
    if (placed) return std::nullopt;
    placed = grid;
  }
  return placed;
}

}  // namespace drape::detect

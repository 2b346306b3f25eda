// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/chessboard.hpp"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/geometry/homography.hpp"
#include "core/geometry/vectors.hpp"
#include "core/rules.hpp"
#include "detect/targets/corner.hpp"

namespace drape::detect {

namespace {

using Eigen::Vector2d;

/// Corners of a chessboard or of a rectangular part of it, by row and column; rows run up if
/// columns run right, as seen from the printed face (core/rig.hpp).
struct BoardGrid {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> px;
  int first_row = 0, first_col = 0;  ///< position on the target

  [[nodiscard]] const Eigen::Vector2d& at(int row, int col) const {
    return px[static_cast<std::size_t>(row) * cols + col];
  }
  /// Position of (`row`, `col`) in or beside the grid, extrapolated from the two nearest corners
  /// along each axis.
  [[nodiscard]] Eigen::Vector2d near(double row, double col) const;
  [[nodiscard]] double nearest_neighbour_px(int row, int col) const;
  /// True if every corner lies where the neighbours on both sides predict it, within a third of
  /// their distance: more than perspective and lens distortion, less than a wrong corner.
  [[nodiscard]] bool is_regular() const;

  /// Quarter turn: the last row becomes the first column.
  [[nodiscard]] BoardGrid turned() const;
  /// Mirrors the grid if needed, so that rows run up if columns run right.
  void unmirror();
};

/// Fractions of the board's contrast: least alternation of squares, largest alternation of the
/// rim.
constexpr double kSquares = 0.5, kRim = 0.25;

std::optional<double> level_near(const GreyImage& image, const Vector2d& px) {
  const long x = std::lround(px.x()), y = std::lround(px.y());
  if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) return std::nullopt;
  return image.level(static_cast<int>(x), static_cast<int>(y));
}

/// Levels of the squares `beyond` pitches outside one side, from one end of it to the other.
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

/// Mean difference of neighbours, with alternating sign.
double alternation(const std::vector<double>& levels) {
  double sum = 0;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i)
    sum += (i % 2 == 0 ? 1 : -1) * (levels[i] - levels[i + 1]);
  return std::abs(sum) / static_cast<double>(levels.size() - 1);
}

/// True if the board ends beyond one side of the grid: one more row of squares, then a light rim.
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

/// First row or column on the board, for an axis with `seen` of its `whole` corners.
std::optional<int> first_of(int seen, int whole, bool low_end, bool high_end) {
  if (seen == whole) return 0;
  if (seen > whole || low_end == high_end) return std::nullopt;
  return low_end ? 0 : whole - seen;
}

Vector2d BoardGrid::near(double row, double col) const {
  const int r = std::clamp(static_cast<int>(std::floor(row)), 0, rows - 2);
  const int c = std::clamp(static_cast<int>(std::floor(col)), 0, cols - 2);
  // Homography of the four corners: squares beyond the end of a tilted board change in size.
  const auto map = square_homography({at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)});
  return map ? mapped(*map, {col - c, row - r}) : at(r, c);
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
  if (cross(along_cols, along_rows) < 0) return;
  const BoardGrid old = *this;
  for (int row = 0; row < rows; ++row)
    for (int col = 0; col < cols; ++col)
      px[static_cast<std::size_t>(row) * cols + col] = old.at(rows - 1 - row, col);
}

/// Mean grey level of the squares with even row + col minus that of the others.
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

/// Locates a rectangle of corners on the board. An incomplete axis must show one of the board's
/// ends, where a light rim follows the last squares. nullopt unless exactly one position agrees
/// with the picture.
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
    // The square inside corner (0, 0) must be dark.
    if (even_over_odd(image, grid) > 0) continue;
    if (placed) return std::nullopt;
    placed = grid;
  }
  return placed;
}

/// Least part of a board, in corners per axis, for the finder to start from: from three it
/// sometimes grows a skewed grid that is not part of a board.
constexpr int kLeastParts[] = {4, 3};
constexpr double kWindowFraction = 0.25;  ///< half window over distance to the nearest neighbour

BoardGrid grid_of(int rows, int cols, const std::vector<cv::Point2f>& corners) {
  BoardGrid grid{rows, cols, {}, 0, 0};
  for (const cv::Point2f& corner : corners) grid.px.emplace_back(corner.x, corner.y);
  grid.unmirror();
  return grid;
}

/// True for a regular grid with two levels of squares: finders may see a board of 3 x 4 corners in
/// noise. Adjacent squares must differ by more than twice the scatter within a square.
bool is_board(const GreyImage& image, const BoardGrid& grid) {
  constexpr double kLeastScatters = 2;
  if (!grid.is_regular()) return false;
  double difference = 0, within = 0;
  int squares = 0;
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int col = 0; col + 1 < grid.cols; ++col) {
      double sum = 0, sum_of_squares = 0;
      int count = 0;
      for (const double down : {0.3, 0.5, 0.7})
        for (const double right : {0.3, 0.5, 0.7})
          if (const auto level = level_near(image, grid.near(row + down, col + right))) {
            sum += *level;
            sum_of_squares += *level * *level;
            ++count;
          }
      if (count == 0) continue;
      ++squares;
      difference += ((row + col) % 2 == 0 ? 1 : -1) * sum / count;
      within += sum_of_squares / count - sum * sum / count / count;
    }
  }
  // The mean over all squares with alternating sign is half the difference of the two levels.
  return squares > 0 && 2 * std::abs(difference) / squares >
                            kLeastScatters * std::sqrt(std::max(0.0, within) / squares);
}

std::optional<BoardGrid> board_of(const GreyImage& image, BoardGrid grid) {
  if (!is_board(image, grid)) return std::nullopt;
  return grid;
}

/// Finds corners by sectors (Duda and Frese 2018), in bounded time; with CALIB_CB_LARGER, those of
/// a board with at least `size` corners.
std::optional<BoardGrid> by_sectors(const GreyImage& image, const cv::Size& size, int flags) {
  std::vector<cv::Point2f> corners;
  cv::Mat pattern;
  if (!cv::findChessboardCornersSB(view_of(image), size, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | flags, pattern) ||
      corners.size() != pattern.total())
    return std::nullopt;
  return board_of(image, grid_of(pattern.rows, pattern.cols, corners));
}

/// Number of pixels on which the quadrilateral finder ends within a second for any picture.
constexpr double kQuadrangles_px = 0.3e6;

/// Finds corners by quadrilaterals, which needs no light rim, in a picture reduced if it is large.
std::optional<BoardGrid> by_quadrangles(const GreyImage& image, const cv::Size& size) {
  const cv::Mat view = view_of(image);
  const double scale = std::min(1.0, std::sqrt(kQuadrangles_px / double(view.total())));
  cv::Mat reduced = view;
  if (scale < 1) cv::resize(view, reduced, {}, scale, scale, cv::INTER_AREA);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(
          reduced, size, corners,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK))
    return std::nullopt;
  const float by_x = float(view.cols) / float(reduced.cols),
              by_y = float(view.rows) / float(reduced.rows);
  for (cv::Point2f& corner : corners)
    corner = {(corner.x + 0.5F) * by_x - 0.5F, (corner.y + 0.5F) * by_y - 0.5F};
  return board_of(image, grid_of(size.height, size.width, corners));
}

/// Board found in a picture, complete or in part.
struct SeenBoard {
  std::optional<BoardGrid> whole, part;  ///< a part with a unique position on the board
  bool most = false;  ///< the picture has a regular grid of at least half the corners
};

SeenBoard seen_board(const GreyImage& image, const Target& target) {
  const cv::Size size(target.cols, target.rows);
  SeenBoard seen;
  seen.whole = by_sectors(image, size, 0);
  if (!seen.whole) seen.whole = by_quadrangles(image, size);
  if (seen.whole) return seen;
  for (const int least : kLeastParts) {
    auto grid = by_sectors(image, {least, least}, cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER);
    if (!grid) continue;
    seen.most |= 2 * grid->rows * grid->cols >= target.rows * target.cols;
    if (grid->rows == target.cols && grid->cols == target.rows) grid = grid->turned();
    if (grid->rows == target.rows && grid->cols == target.cols) {
      seen.whole = std::move(grid);
      return seen;
    }
    if (is_ambiguous(target)) continue;
    seen.part = placed_on_board(image, target, *grid);
    if (seen.part) return seen;
  }
  seen.whole = by_sectors(image, size, cv::CALIB_CB_EXHAUSTIVE);
  return seen;
}

/// True if the board in the picture suggests that the target's size counts squares, not corners.
bool squares_were_counted(const GreyImage& image, const Target& target) {
  return std::min(target.cols, target.rows) > 3 &&
         by_quadrangles(image, {target.cols - 1, target.rows - 1});
}

/// Turns the labels by half a turn unless the square inside corner (0, 0) is dark; for an ambiguous
/// board, makes columns run to the right.
void orient(const GreyImage& image, const Target& target, BoardGrid& grid) {
  const bool turned = is_ambiguous(target) ? grid.at(0, grid.cols - 1).x() < grid.at(0, 0).x()
                                           : even_over_odd(image, grid) > 0;
  if (turned) std::reverse(grid.px.begin(), grid.px.end());
}

}  // namespace

FrameDetections detect_chessboard(const GreyImage& image, const Target& target) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  SeenBoard seen = seen_board(image, target);
  if (seen.whole) orient(image, target, *seen.whole);
  const std::optional<BoardGrid> grid = seen.whole ? std::move(seen.whole) : std::move(seen.part);
  if (!grid) {
    frame.rejections.push_back(
        {std::nullopt, std::nullopt,
         seen.most && squares_were_counted(image, target)
             ? fmt::format("squares counted for corners: the board has {} x {} inner corners, not "
                           "{} x {}",
                           target.cols - 1, target.rows - 1, target.cols, target.rows)
             : fmt::format("no whole chessboard, and no part of it whose place is certain: {} x {} "
                           "inner corners are not all in the picture",
                           target.cols, target.rows)});
    return frame;
  }
  const double contrast = std::abs(even_over_odd(image, *grid));
  std::vector<CornerPoint> points;
  for (int row = 0; row < grid->rows; ++row) {
    for (int col = 0; col < grid->cols; ++col) {
      const MarkId mark{grid->first_row + row, grid->first_col + col};
      const double spacing = grid->nearest_neighbour_px(row, col);
      const int half_window =
          std::max(kLeastHalfWindow_px, static_cast<int>(std::lround(kWindowFraction * spacing)));
      const auto point = find_corner_point(image, grid->at(row, col), half_window);
      if (!point) {
        frame.rejections.push_back(
            {mark, grid->at(row, col), "the edges around the corner do not meet in one point"});
        continue;
      }
      points.push_back(*point);
      frame.detections.push_back({mark, point->centre_px, Eigen::Matrix2d::Identity(),
                                  Eigen::Vector2d::Constant(point->half_window_px), 0, contrast,
                                  0});
    }
  }
  set_corner_covariances(target, points, frame);
  return frame;
}

}  // namespace drape::detect

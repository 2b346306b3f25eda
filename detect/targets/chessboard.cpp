// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/chessboard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "detect/targets/corner_covariance.hpp"
#include "detect/targets/corner_point.hpp"

namespace drape::detect {
namespace {

constexpr double kWindowFraction = 0.25;  ///< of the distance to the nearest neighbour

/// Corners by (row, col), with the places of their neighbours.
struct Grid {
  int rows = 0, cols = 0;
  std::vector<Eigen::Vector2d> px;

  [[nodiscard]] const Eigen::Vector2d& at(int row, int col) const {
    return px[static_cast<std::size_t>(row * cols + col)];
  }
  [[nodiscard]] double nearest_neighbour_px(int row, int col) const {
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
};

/// A view without a copy; OpenCV only reads it.
cv::Mat view_of(const GreyImage& image) {
  return {image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.bytes.data())};
}

/// By quadrangles, and where these fail by the sector-based finder (Duda and Frese 2018).
std::optional<Grid> find_grid(const GreyImage& image, const Target& target) {
  const cv::Mat view = view_of(image);
  const cv::Size size(target.cols, target.rows);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(view, size, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE) &&
      !cv::findChessboardCornersSB(view, size, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE)) {
    return std::nullopt;
  }
  Grid grid{target.rows, target.cols, {}};
  for (const cv::Point2f& corner : corners) grid.px.emplace_back(corner.x, corner.y);
  return grid;
}

/// Whether the picture shows the board that the target would be, were its squares counted.
bool squares_were_counted(const GreyImage& image, const Target& target) {
  const cv::Size inner(target.cols - 1, target.rows - 1);
  std::vector<cv::Point2f> corners;
  return inner.width > 2 && inner.height > 2 &&
         cv::findChessboardCorners(
             view_of(image), inner, corners,
             cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
}

/// Rows run up when columns run right, as one sees the printed face (core/rig.hpp).
void unmirror(Grid& grid) {
  const Eigen::Vector2d along_cols = grid.at(0, grid.cols - 1) - grid.at(0, 0);
  const Eigen::Vector2d along_rows = grid.at(grid.rows - 1, 0) - grid.at(0, 0);
  if (along_cols.x() * along_rows.y() - along_cols.y() * along_rows.x() < 0) return;
  const Grid old = grid;
  for (int row = 0; row < grid.rows; ++row) {
    for (int col = 0; col < grid.cols; ++col) {
      grid.px[static_cast<std::size_t>(row * grid.cols + col)] = old.at(grid.rows - 1 - row, col);
    }
  }
}

/// How much brighter the squares with even row + col are than the others, grey levels.
double even_over_odd(const GreyImage& image, const Grid& grid) {
  double sums[2] = {0, 0};
  int counts[2] = {0, 0};
  for (int row = 0; row + 1 < grid.rows; ++row) {
    for (int col = 0; col + 1 < grid.cols; ++col) {
      const Eigen::Vector2d middle = (grid.at(row, col) + grid.at(row + 1, col) +
                                      grid.at(row, col + 1) + grid.at(row + 1, col + 1)) /
                                     4;
      const int parity = (row + col) % 2;
      sums[parity] += image.level(static_cast<int>(std::lround(middle.x())),
                                  static_cast<int>(std::lround(middle.y())));
      ++counts[parity];
    }
  }
  return sums[0] / counts[0] - sums[1] / counts[1];
}

/// Turns the labels by half a turn unless the square inside corner (0, 0) is dark; a board that
/// does not tell gets its columns to the right.
void orient(const GreyImage& image, const Target& target, Grid& grid) {
  const bool turned = is_ambiguous(target) ? grid.at(0, grid.cols - 1).x() < grid.at(0, 0).x()
                                           : even_over_odd(image, grid) > 0;
  if (turned) std::reverse(grid.px.begin(), grid.px.end());
}

}  // namespace

bool is_ambiguous(const Target& target) {
  return target.kind == TargetKind::chessboard && (target.rows + target.cols) % 2 == 0;
}

FrameDetections detect_chessboard(const GreyImage& image, const Target& target) {
  FrameDetections frame;
  frame.width_px = image.width_px;
  frame.height_px = image.height_px;
  std::optional<Grid> grid = find_grid(image, target);
  if (!grid) {
    frame.rejections.push_back(
        {std::nullopt, std::nullopt,
         squares_were_counted(image, target)
             ? fmt::format("squares counted for corners: the board has {} x {} inner corners, not "
                           "{} x {}",
                           target.cols - 1, target.rows - 1, target.cols, target.rows)
             : fmt::format("no whole chessboard: {} x {} inner corners are not all in the picture",
                           target.cols, target.rows)});
    return frame;
  }
  unmirror(*grid);
  orient(image, target, *grid);
  const double contrast = std::abs(even_over_odd(image, *grid));
  std::vector<CornerPoint> points;
  for (int row = 0; row < grid->rows; ++row) {
    for (int col = 0; col < grid->cols; ++col) {
      const double spacing = grid->nearest_neighbour_px(row, col);
      const int half_window =
          std::max(kLeastHalfWindow_px, static_cast<int>(std::lround(kWindowFraction * spacing)));
      const auto point = find_corner_point(image, grid->at(row, col), half_window);
      if (!point) {
        frame.rejections.push_back({MarkId{row, col}, grid->at(row, col),
                                    "the edges around the corner do not meet in one point"});
        continue;
      }
      points.push_back(*point);
      frame.detections.push_back({{row, col},
                                  point->centre_px,
                                  Eigen::Matrix2d::Identity(),
                                  Eigen::Vector2d::Constant(half_window),
                                  0,
                                  contrast,
                                  0});
    }
  }
  set_corner_covariances(target, points, frame);
  return frame;
}

}  // namespace drape::detect

// SPDX-License-Identifier: Apache-2.0
#include "detect/targets/chessboard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "detect/targets/board_grid.hpp"
#include "detect/targets/corner_covariance.hpp"
#include "detect/targets/corner_point.hpp"

namespace drape::detect {
namespace {

/// Corners of a part of a board that the finder starts from, along either axis: from three it
/// sometimes grows a skewed grid, which is no part of a board.
constexpr int kLeastParts[] = {4, 3};
constexpr double kWindowFraction = 0.25;  ///< of the distance to the nearest neighbour

/// A view without a copy; OpenCV only reads it.
cv::Mat view_of(const GreyImage& image) {
  return {image.height_px, image.width_px, CV_8UC1, const_cast<std::uint8_t*>(image.bytes.data())};
}

BoardGrid grid_of(int rows, int cols, const std::vector<cv::Point2f>& corners) {
  BoardGrid grid{rows, cols, {}, 0, 0};
  for (const cv::Point2f& corner : corners) grid.px.emplace_back(corner.x, corner.y);
  grid.unmirror();
  return grid;
}

/// By quadrangles, and where these fail by the sector-based finder (Duda and Frese 2018).
std::optional<BoardGrid> whole_board(const GreyImage& image, const Target& target) {
  const cv::Mat view = view_of(image);
  const cv::Size size(target.cols, target.rows);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(view, size, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE) &&
      !cv::findChessboardCornersSB(view, size, corners,
                                   cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE)) {
    return std::nullopt;
  }
  return grid_of(target.rows, target.cols, corners);
}

/// The largest rectangle of corners that is seen, where its place on the board is beyond doubt.
std::optional<BoardGrid> part_of_board(const GreyImage& image, const Target& target) {
  if (is_ambiguous(target)) return std::nullopt;
  for (const int least : kLeastParts) {
    std::vector<cv::Point2f> corners;
    cv::Mat pattern;
    if (!cv::findChessboardCornersSB(
            view_of(image), {least, least}, corners,
            cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_LARGER,
            pattern) ||
        corners.size() != pattern.total()) {
      continue;
    }
    const BoardGrid grid = grid_of(pattern.rows, pattern.cols, corners);
    if (!grid.is_regular()) continue;
    if (auto placed = placed_on_board(image, target, grid)) return placed;
  }
  return std::nullopt;
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

/// Turns the labels by half a turn unless the square inside corner (0, 0) is dark; a board that
/// does not tell gets its columns to the right.
void orient(const GreyImage& image, const Target& target, BoardGrid& grid) {
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
  std::optional<BoardGrid> grid = whole_board(image, target);
  if (grid) {
    orient(image, target, *grid);
  } else {
    grid = part_of_board(image, target);
  }
  if (!grid) {
    frame.rejections.push_back(
        {std::nullopt, std::nullopt,
         squares_were_counted(image, target)
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

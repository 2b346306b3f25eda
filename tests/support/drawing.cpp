// SPDX-License-Identifier: Apache-2.0
#include "tests/support/drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/files/files.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using Eigen::Vector2d;

constexpr int kFine = 8;    // points per side of a pixel
constexpr int kShift = 10;  // fractional bits of OpenCV's fixed point

Vector2d fine_px(const Vector2d& px) {
  return kFine * (px.array() + 0.5) - 0.5;
}

}  // namespace

Drawing::Drawing(int width_px, int height_px, int grey)
    : fine_(height_px * kFine, width_px * kFine, CV_8U, cv::Scalar(grey)) {}

void Drawing::polygon(const std::vector<Vector2d>& corners_px, int grey) {
  std::vector<cv::Point> corners;
  for (const Vector2d& corner : corners_px) {
    const Vector2d at = fine_px(corner) * (1 << kShift);
    corners.emplace_back(cvRound(at.x()), cvRound(at.y()));
  }
  cv::fillConvexPoly(fine_, corners, grey, cv::LINE_8, kShift);
}

void Drawing::ellipse(const Vector2d& centre_px, const Vector2d& semi_axes_px, double angle_deg,
                      int grey) {
  const Eigen::Vector2f at = fine_px(centre_px).cast<float>();
  const Eigen::Vector2f size = (2 * kFine * semi_axes_px).cast<float>();
  cv::ellipse(fine_, {{at.x(), at.y()}, {size.x(), size.y()}, static_cast<float>(angle_deg)}, grey,
              cv::FILLED);
}

cv::Mat Drawing::picture(double blur_px) const {
  cv::Mat picture;
  cv::resize(fine_, picture, fine_.size() / kFine, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(picture, picture, {0, 0}, blur_px);
  return picture;
}

void draw_stereo_chessboard(const std::filesystem::path& folder, int cols) {
  constexpr int kRows = 6, kCols = 9;
  const Csv file =
      read_csv(test_data("stereo-chessboard") / "corners.csv", {"camera", "view", "u_px", "v_px"});
  std::map<std::pair<double, double>, std::vector<Vector2d>> boards;
  for (std::size_t i = 0; i < file.lines.size(); ++i)
    boards[{file.columns[0][i], file.columns[1][i]}].emplace_back(file.columns[2][i],
                                                                  file.columns[3][i]);
  std::filesystem::create_directories(folder);
  for (const auto& [of, corners] : boards) {
    // The outer squares end where their edges are continued in a straight line.
    const auto corner = [&, &found = corners](int row, int col) {
      const int r = std::clamp(row, 0, kRows - 1), c = std::clamp(col, 0, cols - 1);
      const auto at = [&](int i, int k) { return found[static_cast<std::size_t>(i) * kCols + k]; };
      Vector2d place = at(r, c);
      if (row != r) place += at(r, c) - at(r + (r == 0 ? 1 : -1), c);
      if (col != c) place += at(r, c) - at(r, c + (c == 0 ? 1 : -1));
      return place;
    };
    Drawing drawing(640, 480, 200);
    for (int row = -1; row < kRows; ++row)
      for (int col = -1; col < cols; ++col)
        if ((row + col) % 2 == 0)
          drawing.polygon({corner(row, col), corner(row, col + 1), corner(row + 1, col + 1),
                           corner(row + 1, col)},
                          40);
    const char* camera = of.first == 0 ? "left" : "right";
    cv::imwrite((folder / fmt::format("{}{:02}.png", camera, of.second)).string(),
                drawing.picture(0.7));
  }
}

}  // namespace drape::test

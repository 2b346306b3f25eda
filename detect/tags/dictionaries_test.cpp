// SPDX-License-Identifier: Apache-2.0
// Markers of OpenCV's own dictionaries, compared with OpenCV's drawings.
#include <gtest/gtest.h>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/imgproc.hpp>

#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "detect/targets/board.hpp"
#include "detect/test_pictures.hpp"

namespace drape::test {

using namespace detect;

namespace {

/// Every dictionary with its number in OpenCV's enumeration.
std::vector<std::pair<std::string, int>> dictionaries() {
  std::vector<std::pair<std::string, int>> found;
  for (const auto& [name, count] : known_tag_families())
    if (name.starts_with("DICT_")) found.emplace_back(name, static_cast<int>(found.size()));
  return found;
}

TEST(Dictionaries, MarkersAreThoseThatOpenCvDraws) {
  ASSERT_EQ(dictionaries().size(), 17U);
  for (const auto& [name, number] : dictionaries()) {
    SCOPED_TRACE(name);
    const TagFamily family(name);
    const auto drawn = cv::aruco::getPredefinedDictionary(number);
    ASSERT_EQ(family.count(), drawn->bytesList.rows);
    for (const int id : {0, family.count() / 2, family.count() - 1}) {
      cv::Mat marker;
      drawn->drawMarker(id, family.edge_modules(), marker);
      for (int y = 0; y < marker.rows; ++y)
        for (int x = 0; x < marker.cols; ++x)
          ASSERT_EQ(family.black(id, x + 1, y + 1), marker.at<unsigned char>(y, x) == 0)
              << id << ": " << x << ", " << y;
    }
  }
}

TEST(Dictionaries, ACharucoBoardOfEachSizeIsReadAsOpenCvDrawsIt) {
  constexpr int kCols = 7, kRows = 5, kSquare_px = 80, kMargin_px = 20;
  for (const char* name :
       {"DICT_4X4_50", "DICT_5X5_100", "DICT_6X6_250", "DICT_7X7_1000", "DICT_ARUCO_ORIGINAL"}) {
    SCOPED_TRACE(name);
    int number = -1;
    for (const auto& [known, at] : dictionaries())
      if (known == name) number = at;
    const auto board = cv::aruco::CharucoBoard::create(kCols, kRows, 0.04F, 0.03F,
                                                       cv::aruco::getPredefinedDictionary(number));
    cv::Mat flat, seen;
    board->draw({kCols * kSquare_px + 2 * kMargin_px, kRows * kSquare_px + 2 * kMargin_px}, flat,
                kMargin_px, 1);
    Eigen::Matrix3d view;
    view << 0.95, -0.18, 150, 0.2, 0.9, 40, 1e-4, -5e-5, 1;
    Eigen::Matrix3d by_rows = view.transpose();
    const cv::Mat warp(3, 3, CV_64F, by_rows.data());
    cv::warpPerspective(flat, seen, warp, {840, 660}, cv::INTER_AREA, cv::BORDER_CONSTANT, 255);
    seen.convertTo(seen, CV_8U, 0.6, 40);
    cv::GaussianBlur(seen, seen, {}, 0.7);
    Target target;
    target.kind = TargetKind::charuco;
    target.rows = kRows - 1;
    target.cols = kCols - 1;
    target.pitch_m = 0.04;
    target.tag_family = name;
    target.tag_edge_m = 0.03;
    int id = 0;
    for (int row = 0; row < kRows; ++row)
      for (int col = 0; col < kCols; ++col)
        if ((row + col) % 2 == 1)
          target.tags.push_back(
              {id++, 0.04 * Eigen::Vector2d(col - 0.5 * (kCols - 1), 0.5 * (kRows - 1) - row)});
    const FrameDetections frame = detect_board(image_of(seen), target);
    EXPECT_EQ(frame.tags.size(), target.tags.size());
    EXPECT_EQ(frame.detections.size(), static_cast<std::size_t>(target.rows * target.cols));
    for (const Detection& corner : frame.detections) {
      const Eigen::Vector2d at(kMargin_px + kSquare_px * (corner.mark.col + 1) - 0.5,
                               kMargin_px + kSquare_px * (target.rows - corner.mark.row) - 0.5);
      EXPECT_LT((mapped(view, at) - corner.centre_px).norm(), 0.3)
          << corner.mark.row << ", " << corner.mark.col;
    }
  }
}

}  // namespace
}  // namespace drape::test

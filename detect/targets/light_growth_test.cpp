// SPDX-License-Identifier: Apache-2.0
// Tags of an AprilGrid, whose corners touch small black squares, with and without growth of light
// areas into dark ones.
#include "detect/targets/board.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core.hpp>
#include <tuple>

#include "core/files/files.hpp"
#include "detect/tags/tags.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {

using namespace detect;

namespace {

using Eigen::Vector2d;

constexpr double turn_rad = 0.2, noise_grey = 1.5;
constexpr int tags_across = 3;

/// A grid of tags with a border of two modules, three tenths of a tag apart, with small squares in
/// between, slightly rotated; the first tag's upper left corner is at `first_px`.
class Grid {
 public:
  /// `quarters`: turns of each tag's print in its place.
  explicit Grid(int across = tags_across, int down = tags_across, int quarters = 0)
      : family_("tag36h11", 2),
        across_(across),
        down_(down),
        quarters_(quarters),
        tag_px_(family_.edge_modules() * module_px) {
    turn_ = Eigen::Rotation2D<double>(turn_rad).toRotationMatrix();
  }

  [[nodiscard]] Vector2d corner_px(int id, int corner) const {
    const Vector2d at(corner == 1 || corner == 2 ? tag_px_ : 0, corner > 1 ? tag_px_ : 0);
    return turn_ * (pitch_px() * Vector2d(id % across_, id / across_) + at) + first_px;
  }

  [[nodiscard]] GreyImage draw() const {
    const auto level = [&](const Vector2d& px) {
      return is_black(turn_.transpose() * (px - first_px)) ? 40.0 : 190.0;
    };
    return exposed(sampled(150 + 90 * across_, 150 + 90 * down_, 4, level), 0.6, noise_grey, 9);
  }

 private:
  [[nodiscard]] double pitch_px() const { return 1.3 * tag_px_; }

  [[nodiscard]] bool is_black(const Vector2d& at) const {
    const Vector2d cell = (at / pitch_px()).array().floor();
    const Vector2d in = at - pitch_px() * cell;
    if (cell.minCoeff() < -1 || cell.x() >= across_ || cell.y() >= down_) return false;
    // Small squares are where the gaps of rows and columns cross, also around the outer tags.
    if (in.minCoeff() >= tag_px_) return true;
    if (cell.minCoeff() < 0 || in.maxCoeff() >= tag_px_) return false;
    const int margin = (family_.total_modules() - family_.edge_modules()) / 2;
    int x = static_cast<int>(in.x() / module_px), y = static_cast<int>(in.y() / module_px);
    for (int k = 0; k < quarters_; ++k)
      std::tie(x, y) = std::pair(y, family_.edge_modules() - 1 - x);
    return family_.black(static_cast<int>(cell.y()) * across_ + static_cast<int>(cell.x()),
                         x + margin, y + margin);
  }

  static constexpr double module_px = 8;
  TagFamily family_;
  int across_, down_, quarters_;
  double tag_px_;
  Eigen::Matrix2d turn_;
  Vector2d first_px{100, 48};
};

TEST(LightGrowth, DarkShapesShrinkByAsMuchOnEverySide) {
  GreyImage image{40, 30, std::vector<std::uint8_t>(40 * 30, 200), {}};
  for (int y = 8; y < 20; ++y) {
    for (int x = 10; x < 25; ++x) image.bytes[y * 40 + x] = 30;
  }
  const GreyImage grown = with_light_grown(image, 2);
  ASSERT_EQ(grown.bytes.size(), image.bytes.size());
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool dark = y >= 10 && y < 18 && x >= 12 && x < 23;
      EXPECT_EQ(grown.bytes[y * 40 + x], dark ? 30 : 200) << x << ", " << y;
    }
  }
}

TEST(LightGrowth, CornersGoBackToWhereTheyWere) {
  // A square window that touches a straight edge from within displaces it by this much times the
  // sum of its normal's absolute coordinates.
  const double by = 3;
  const Eigen::Matrix2d turn = Eigen::Rotation2D<double>(0.3).toRotationMatrix();
  Eigen::Matrix<double, 2, 4> square, shrunk;
  square << -40, 40, 40, -40, -40, -40, 40, 40;
  const double edge = by * (std::abs(turn(0, 0)) + std::abs(turn(1, 0)));
  shrunk = turn * square * (1 - edge / 40);
  square = turn * square;
  EXPECT_LT((without_growth(shrunk, 3) - square).norm(), 1e-9);
}

TEST(LightGrowth, TagsBetweenSmallSquaresAreReadWithItAndNotWithout) {
  const Grid grid;
  const GreyImage image = grid.draw();
  const std::size_t tags = tags_across * tags_across;
  TagFinder finder("tag36h11", {.border_modules = 2, .wrong_bits = 1, .refine_edges = true});
  EXPECT_LT(finder.find_all(image, noise_grey).size(), tags);
  const std::vector<TagDetection> found = finder.find_all(with_light_grown(image, 2), noise_grey);
  ASSERT_EQ(found.size(), tags);
  for (const TagDetection& tag : found) {
    const Eigen::Matrix<double, 2, 4> corners = without_growth(tag.corners_px, 2);
    for (int k = 0; k < 4; ++k) {
      const Vector2d truth = grid.corner_px(tag.id, k);
      // The library's unrefined corners have errors of some tenths of a pixel (0.07 px RMS on a
      // sharp tag, more if blur rounds the corner); grown ones by the growth.
      EXPECT_LT((corners.col(k) - truth).norm(), 1.0) << "tag " << tag.id << ", corner " << k;
      EXPECT_GT((tag.corners_px.col(k) - truth).norm(), 2.0);
    }
  }
}

/// A target of one row of tags, whose centres lie on a line: the corners tell how they are turned.
TEST(TaggedBoard, ARowOfTurnedTagsGivesTheSameCorners) {
  const TemporaryFolder folder;
  write_durable(folder.path() / "target.toml",
                "schema = \"drapebench/target/1\"\nkind = \"aprilgrid\"\nrows = 1\ncols = 5\n"
                "pitch_mm = 26\n[tags]\nfamily = \"tag36h11\"\nedge_mm = 20\n");
  const Target target = read_target(folder.path() / "target.toml");
  const FrameDetections upright = detect_board(Grid(5, 1).draw(), target);
  ASSERT_EQ(upright.detections.size(), 20u);
  for (const int quarters : {1, 2, 3}) {
    const FrameDetections turned = detect_board(Grid(5, 1, quarters).draw(), target);
    ASSERT_EQ(turned.detections.size(), 20u) << quarters;
    for (std::size_t i = 0; i < 20; ++i) {
      EXPECT_EQ(turned.detections[i].mark, upright.detections[i].mark);
      EXPECT_LT((turned.detections[i].centre_px - upright.detections[i].centre_px).norm(), 0.5);
    }
  }
}

}  // namespace
}  // namespace drape::test

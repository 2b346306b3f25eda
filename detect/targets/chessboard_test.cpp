// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <Eigen/Geometry>
#include <cstdio>
#include <ctime>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "core/scene.hpp"
#include "detect/targets/board.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::detect {
namespace {

Target board(int rows, int cols) {
  Target target;
  target.kind = TargetKind::chessboard;
  target.rows = rows;
  target.cols = cols;
  target.pitch_m = 1;
  return target;
}

/// Picture of a board whose corner (row, col) is at image_from_board (col, row, 1): dark between
/// the corners (0, 0) and (1, 1), sampled 8 x 8 per pixel, with noise of 2 grey levels.
GreyImage picture_of(const Target& target, const Eigen::Matrix3d& image_from_board,
                     int width_px = 640, int height_px = 480) {
  const Eigen::Matrix3d board_from_image = image_from_board.inverse();
  const auto level = [&](const Eigen::Vector2d& px) {
    const Eigen::Vector2d place = mapped(board_from_image, px);
    const int col = static_cast<int>(std::floor(place.x()));
    const int row = static_cast<int>(std::floor(place.y()));
    const bool on_board = col >= -1 && row >= -1 && col < target.cols && row < target.rows;
    return on_board && (row + col) % 2 == 0 ? 40.0 : 200.0;
  };
  return test::exposed(test::sampled(width_px, height_px, 8, level), 0, 2, 7);
}

/// Columns to the right and rows up, rotated by `angle_deg`, with perspective.
Eigen::Matrix3d view(double angle_deg, double pitch_px) {
  const double angle = angle_deg * std::acos(-1.0) / 180;
  Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
  centred.topRightCorner<2, 1>() << -4, -2.5;
  Eigen::Matrix3d scaled;
  scaled << pitch_px * std::cos(angle), pitch_px * std::sin(angle), 320.3,  //
      pitch_px * std::sin(angle), -pitch_px * std::cos(angle), 240.7,       //
      0.0, 0.0, 1.0;
  Eigen::Matrix3d tilted = Eigen::Matrix3d::Identity();
  tilted(2, 0) = 0.02;
  return scaled * tilted * centred;
}

/// The view in a picture of half the size, which OpenCV searches in a quarter of the time.
Eigen::Matrix3d halved(const Eigen::Matrix3d& image_from_board) {
  return Eigen::Vector3d(0.5, 0.5, 1).asDiagonal() * image_from_board;
}

GreyImage small_picture_of(const Target& target, const Eigen::Matrix3d& image_from_board) {
  return picture_of(target, image_from_board, 320, 240);
}

Eigen::Vector2d error_px(const Detection& corner, const Eigen::Matrix3d& image_from_board) {
  return corner.centre_px - mapped(image_from_board, {corner.mark.col, corner.mark.row});
}

double rms_error_px(const FrameDetections& frame, const Eigen::Matrix3d& image_from_board) {
  double squares = 0;
  for (const Detection& corner : frame.detections)
    squares += error_px(corner, image_from_board).squaredNorm();
  return std::sqrt(squares / static_cast<double>(frame.detections.size()));
}

/// Squared error along an axis in units of the stated variance.
double normalised(const Detection& corner, const Eigen::Matrix3d& image_from_board) {
  const Eigen::Vector2d error = error_px(corner, image_from_board);
  return error.dot(corner.covariance_px2.inverse() * error) / 2;
}

TEST(Chessboard, CornersKeepTheirLabelsHoweverTheBoardIsTurned) {
  const Target target = board(6, 9);
  for (const double angle_deg : {0.0, 35.0, 90.0, 180.0, 250.0}) {
    const Eigen::Matrix3d image_from_board = view(angle_deg, 36);
    const FrameDetections frame = detect_chessboard(picture_of(target, image_from_board), target);
    ASSERT_EQ(frame.detections.size(), 54U) << angle_deg;
    // A wrong label is off by one square, 30 px or more.
    EXPECT_LT(rms_error_px(frame, image_from_board), 0.1) << angle_deg;
  }
}

TEST(Chessboard, TheStatedUncertaintyIsThatOfTheErrors) {
  const Target target = board(6, 9);
  double sum = 0;
  int corners = 0;
  for (const double angle_deg : {3.0, 20.0, 41.0, 75.0}) {
    const Eigen::Matrix3d image_from_board = view(angle_deg, 30);
    const FrameDetections frame = detect_chessboard(picture_of(target, image_from_board), target);
    for (const Detection& corner : frame.detections) {
      sum += normalised(corner, image_from_board);
      ++corners;
    }
  }
  ASSERT_EQ(corners, 4 * 54);
  // Mean of 216 values with expectation 1; the scale is estimated from some 80 differences a frame.
  EXPECT_NEAR(sum / corners, 1, 0.5);
}

Eigen::Matrix3d shifted(Eigen::Matrix3d image_from_board, double right_px, double down_px) {
  image_from_board.row(0) += right_px * image_from_board.row(2);
  image_from_board.row(1) += down_px * image_from_board.row(2);
  return image_from_board;
}

TEST(Chessboard, ThePartOfACutOffBoardKeepsItsLabels) {
  const Target target = board(6, 9);
  // Columns are cut off on both sides, upright and upside down.
  for (const double angle_deg : {0.0, 180.0}) {
    for (const double right_px : {250.0, -250.0}) {
      const Eigen::Matrix3d image_from_board = halved(shifted(view(angle_deg, 36), right_px, 0));
      const FrameDetections frame =
          detect_chessboard(small_picture_of(target, image_from_board), target);
      EXPECT_GE(frame.detections.size(), 24U) << angle_deg << " " << right_px;
      EXPECT_LT(frame.detections.size(), 54U);
      EXPECT_LT(rms_error_px(frame, image_from_board), 0.1) << angle_deg << " " << right_px;
    }
  }
}

// The window of a corner at the picture's edge shrinks, and its stated uncertainty grows.
TEST(Chessboard, NoCornerIsLeftOutAtThePicturesEdge) {
  const Target target = board(6, 9);
  double sum = 0;
  int corners = 0;
  for (const double left_px : {5.2, 6.7, 7.9, 9.4}) {
    Eigen::Matrix3d turned = halved(view(3, 50));
    turned(2, 0) = turned(2, 1) = 0;  // no perspective
    turned /= turned(2, 2);
    double first_px = 320;
    for (const int row : {0, 5}) first_px = std::min(first_px, mapped(turned, {0, row}).x());
    const Eigen::Matrix3d image_from_board = shifted(turned, left_px - first_px, 0);
    const FrameDetections frame =
        detect_chessboard(small_picture_of(target, image_from_board), target);
    EXPECT_EQ(frame.detections.size(), 54U) << left_px;
    for (const Detection& corner : frame.detections) {
      if (corner.mark.col > 0) continue;
      sum += normalised(corner, image_from_board);
      ++corners;
    }
  }
  ASSERT_EQ(corners, 4 * 6);
  // Mean of 48 values with expectation 1: 3 standard deviations, the scale known to a sixth.
  EXPECT_LT(sum / corners, 1.8);
  EXPECT_GT(sum / corners, 0.4);
}

TEST(Chessboard, APartWhosePlaceIsInDoubtIsRefusedByName) {
  const Target target = board(6, 9);
  // Neither end of the columns is visible.
  const FrameDetections frame =
      detect_chessboard(small_picture_of(target, halved(view(0, 100))), target);
  EXPECT_TRUE(frame.detections.empty());
  ASSERT_EQ(frame.rejections.size(), 1U);
  EXPECT_THAT(frame.rejections[0].reason, testing::HasSubstr("no part of it whose place"));
}

// Counting squares instead of corners gives one row and one column too many.
TEST(Chessboard, SquaresCountedForCornersAreNamed) {
  const int cases = test::trial_count(4, 200);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> turn(0, 360), size(17, 23), off(-15, 15);
  std::uniform_int_distribution<int> rows(4, 7), cols(5, 8);
  for (int i = 0; i < cases; ++i) {
    const Target printed = board(rows(random), cols(random));
    const Target stated = board(printed.rows + 1, printed.cols + 1);
    Eigen::Matrix3d centred = Eigen::Matrix3d::Identity();
    centred(0, 2) = 4 - (printed.cols - 1) / 2.0;
    centred(1, 2) = 2.5 - (printed.rows - 1) / 2.0;
    const Eigen::Matrix3d image_from_board =
        shifted(halved(view(turn(random), 1.6 * size(random))), off(random), off(random)) * centred;
    const FrameDetections frame =
        detect_chessboard(small_picture_of(printed, image_from_board), stated);
    EXPECT_TRUE(frame.detections.empty()) << i << ": " << printed.rows << " x " << printed.cols
                                          << ", " << frame.detections.size() << " corners";
    ASSERT_EQ(frame.rejections.size(), 1U) << i;
    EXPECT_THAT(frame.rejections[0].reason, testing::HasSubstr("squares counted for corners")) << i;
  }
}

TEST(Chessboard, ABoardOfFourByThreeCornersIsRead) {
  const Target small = board(3, 4);
  const Eigen::Matrix3d map = halved(view(20, 60));
  const FrameDetections frame = detect_chessboard(small_picture_of(small, map), small);
  ASSERT_EQ(frame.detections.size(), 12U);
  EXPECT_LT(rms_error_px(frame, map), 0.1);
}

TEST(Chessboard, NoBoardIsSeenInNoise) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(128, 40);
  for (const double blur_px : {0.0, 2.0, 6.0}) {
    const cv::Mat light = test::sampled(480, 360, 1, [&](const Eigen::Vector2d&) {
      return 128 + (noise(random) - 128) * (1 + 2 * blur_px);
    });
    const GreyImage image = test::exposed(light, blur_px, 0, 1);
    EXPECT_TRUE(detect_chessboard(image, board(3, 4)).detections.empty()) << blur_px;
    EXPECT_TRUE(detect_chessboard(image, board(3, 3)).detections.empty()) << blur_px;
  }
}

#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Chessboard, PicturesOfTwoMegapixelsWithoutABoardTakeBelowTwoSeconds) {
  cv::setNumThreads(1);
  std::mt19937 random(3);
  // A dark picture with noise, and blocks of noise, on which the search for quadrangles is slowest.
  for (const auto& [block_px, mean, spread] :
       {std::tuple(1, 8, 5), std::tuple(1, 128, 60), std::tuple(4, 128, 120)}) {
    GreyImage image{1600, 1200, std::vector<std::uint8_t>(1600 * 1200), {}};
    std::uniform_int_distribution<int> level(mean - spread, mean + spread);
    std::vector<std::uint8_t> row(1600);
    for (int y = 0; y < 1200; ++y) {
      if (y % block_px == 0)
        for (int x = 0; x < 1600; ++x)
          row[x] = x % block_px == 0 ? static_cast<std::uint8_t>(level(random)) : row[x - 1];
      std::copy(row.begin(), row.end(), image.bytes.begin() + 1600 * y);
    }
    const std::clock_t start = std::clock();
    EXPECT_TRUE(detect_chessboard(image, board(6, 9)).detections.empty());
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 2.0)
        << block_px << ", " << mean;
  }
}
#endif

TEST(Chessboard, KnowsWhenItsSidesLookAlike) {
  EXPECT_FALSE(is_ambiguous(board(6, 9)));
  EXPECT_TRUE(is_ambiguous(board(6, 8)));
}

}  // namespace
}  // namespace drape::detect

// ----
// Tags of an AprilGrid, whose corners touch small black squares, with and without growth of light
// areas into dark ones.
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

// ----
// Compares the fit with OpenCV's cornerSubPix on rendered corners with blur and noise.
namespace drape::detect {
namespace {

using Eigen::Vector2d;

constexpr int kSide_px = 41;

/// A drawn corner: two edges that cross at `centre` at an angle of at least 35 degrees, blurred,
/// with a gradient of the light and noise, rounded to whole grey levels.
struct DrawnCorner {
  GreyImage image;
  Vector2d centre_px;
};

DrawnCorner drawn_corner(double blur_px, double noise_levels, std::mt19937& random) {
  constexpr int kFine = 6;
  std::uniform_real_distribution<double> unit(0, 1);
  const double first = std::numbers::pi * unit(random);
  const double second = first + std::numbers::pi * (0.2 + 0.6 * unit(random));
  const double dark = 20 + 40 * unit(random), light = 140 + 80 * unit(random);
  const Vector2d slope = Vector2d(unit(random) - 0.5, unit(random) - 0.5) * 0.004;
  DrawnCorner drawn;
  drawn.centre_px =
      Vector2d::Constant((kSide_px - 1) / 2.0) + Vector2d(unit(random) - 0.5, unit(random) - 0.5);
  const cv::Mat levels = test::sampled(kSide_px, kSide_px, kFine, [&](const Vector2d& px) {
    const Vector2d p = px - drawn.centre_px;
    const double a = std::cos(first) * p.y() - std::sin(first) * p.x();
    const double b = std::cos(second) * p.y() - std::sin(second) * p.x();
    return (a * b > 0 ? light : dark) * (1 + slope.dot(p));
  });
  drawn.image = test::exposed(levels, blur_px, noise_levels, static_cast<unsigned>(random()));
  return drawn;
}

Vector2d by_opencv(const DrawnCorner& drawn, const Vector2d& start, int half_window) {
  std::vector<cv::Point2f> corner{{static_cast<float>(start.x()), static_cast<float>(start.y())}};
  cv::cornerSubPix(view_of(drawn.image), corner, {half_window, half_window}, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 100, 1e-4});
  return {corner[0].x, corner[0].y};
}

/// Sums of squared errors, px^2, of corners of one kind.
struct Errors {
  double ours = 0, opencv = 0, stated = 0;
  int corners = 0, fitted = 0;
};

Errors errors_of(int half_window, double blur_px, double noise, int corners) {
  Errors errors;
  std::mt19937 random(
      static_cast<unsigned>(half_window * 1000 + std::lround(100 * blur_px + noise)));
  std::uniform_real_distribution<double> off(-0.7, 0.7);
  for (int i = 0; i < corners; ++i) {
    const DrawnCorner drawn = drawn_corner(blur_px, noise, random);
    const Vector2d start = drawn.centre_px + Vector2d(off(random), off(random));
    const auto point = find_corner_point(drawn.image, start, half_window);
    if (!point) continue;
    ++errors.corners;
    errors.ours += (point->centre_px - drawn.centre_px).squaredNorm();
    errors.opencv += (by_opencv(drawn, start, half_window) - drawn.centre_px).squaredNorm();
    if (const auto fit = fit_saddle(drawn.image, start, half_window + 0.5)) {
      ++errors.fitted;
      errors.stated += noise * noise * fit->normal_matrix.inverse().trace();
    }
  }
  return errors;
}

// The limit is 0.9 times the error of cornerSubPix, with the same start and window.
TEST(SaddleFit, IsAtMostNineTenthsOfCornerSubPixOffOnBlurredNoisyCorners) {
  const int corners = test::trial_count(4, 200);
  for (const int half_window : {4, 6, 10}) {
    double ratios = 0;
    int kinds = 0;
    for (const double blur_px : {0.5, 0.8, 1.2, 2.0}) {
      for (const double noise : {1.0, 3.0, 6.0}) {
        const Errors errors = errors_of(half_window, blur_px, noise, corners);
        ASSERT_GT(errors.corners, 0);
        const double ratio = std::sqrt(errors.ours / errors.opencv);
        std::printf(
            "window %d px, blur %.1f px, noise %.0f: %d corners, %.4f px, cornerSubPix "
            "%.4f px, ratio %.2f; fitted %d, stated %.4f px\n",
            half_window, blur_px, noise, errors.corners, std::sqrt(errors.ours / errors.corners),
            std::sqrt(errors.opencv / errors.corners), ratio, errors.fitted,
            std::sqrt(errors.stated / std::max(errors.fitted, 1)));
        ratios += ratio;
        ++kinds;
        // Too few corners of one kind scatter too much to be judged separately.
        if (corners >= 100) {
          EXPECT_LE(ratio, 0.9);
        }
      }
    }
    EXPECT_LE(ratios / kinds, 0.9) << half_window;
  }
}

TEST(SaddleFit, AnEdgeOrAFlatPatchIsNoCorner) {
  GreyImage flat{kSide_px, kSide_px, std::vector<std::uint8_t>(kSide_px * kSide_px, 128), {}};
  EXPECT_FALSE(find_corner_point(flat, {20, 20}, 6).has_value());
  GreyImage edge = flat;
  for (int y = 0; y < kSide_px; ++y)
    for (int x = 0; x < kSide_px; ++x)
      edge.bytes[static_cast<std::size_t>(y) * kSide_px + x] = x < 20 ? 40 : 200;
  EXPECT_FALSE(find_corner_point(edge, {20, 20}, 6).has_value());
  EXPECT_FALSE(fit_saddle(flat, {3, 3}, 6.5).has_value());
}

}  // namespace
}  // namespace drape::detect

// ----
// Markers of OpenCV's own dictionaries, compared with OpenCV's drawings.
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

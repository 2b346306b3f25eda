// SPDX-License-Identifier: Apache-2.0
// Plain dot grids without tags: the dots of six photographs of an 8 x 10 grid (BoofCV-Data, CC BY
// 4.0), drawn as measured, and the photographs themselves if available.
#include <gmock/gmock.h>
#include <Eigen/LU>
#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "core/files/files.hpp"
#include "core/geometry/vectors.hpp"
#include "detect/test_pictures.hpp"
#include "tests/support/drawing.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/trials.hpp"

namespace drape::test {

using namespace detect;

namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr int photos = 6;

/// A rig and a recording of the photographs, as a user of such a target would make them.
class GridBench {
 public:
  explicit GridBench(const std::vector<fs::path>& pictures) {
    write_durable(folder_.path() / "target.toml",
                  "schema = \"drapebench/target/1\"\nkind = \"dot-grid\"\nrows = 8\ncols = 10\n"
                  "pitch_mm = 25.0\ndot_diameter_mm = 15.0\n");
    rig.name = "grid";
    rig.target_file = folder_.path() / "target.toml";
    rig.cameras = {{"cam0", 640, 480, 1e-6, 1e-6}};
    recording.folder = folder_.path();
    for (int k = 0; k < photos; ++k) {
      const std::string name = "pose_" + std::to_string(k);
      const fs::path& from = pictures[static_cast<std::size_t>(k)];
      const std::string file = name + "/cam0" + from.extension().string();
      fs::create_directories(folder_.path() / name);
      fs::copy_file(from, folder_.path() / file);
      recording.sets.push_back({name, {{"cam0", file, sha256_of_file(from), 640, 480, {}}}});
      options.sets.push_back(name);
    }
    options.surface = Surface::target;
  }

  Rig rig;
  Recording recording;
  DetectOptions options;

 private:
  TemporaryFolder folder_;
};

/// Largest distance from the projective map through all dots, in pitches; a wrong index gives one.
double worst_in_pitches(const std::vector<Detection>& dots) {
  std::vector<Eigen::Vector2d> places, seen;
  for (const Detection& dot : dots) {
    places.emplace_back(dot.mark.col, dot.mark.row);
    seen.push_back(dot.centre_px);
  }
  const Eigen::Matrix3d map = homography(places, seen).value();
  double worst = 0;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    const double pitch = derivative_at(map, places[i]).colwise().norm().minCoeff();
    worst = std::max(worst, (mapped(map, places[i]) - seen[i]).norm() / pitch);
  }
  return worst;
}

/// Paints out a dot: its ellipse and the blur around it get the grey level next to it.
void paint_out(const Detection& dot, GreyImage& image) {
  cv::Mat picture = view_of(image);
  const auto ellipse = [&](double more_px) {
    const Eigen::Vector2d size = 2 * (dot.semi_axes_px.array() + more_px);
    return cv::RotatedRect(
        cv::Point2f(static_cast<float>(dot.centre_px.x()), static_cast<float>(dot.centre_px.y())),
        cv::Size2f(static_cast<float>(size.x()), static_cast<float>(size.y())),
        static_cast<float>(dot.axis_angle_rad * 180 / std::acos(-1.0)));
  };
  cv::Mat ring(picture.size(), CV_8U, cv::Scalar(0));
  cv::ellipse(ring, ellipse(3.0), 255, cv::FILLED);
  cv::ellipse(ring, ellipse(2.0), 0, cv::FILLED);
  cv::ellipse(picture, ellipse(2.0), cv::mean(picture, ring), cv::FILLED);
}

GreyImage without(const std::set<MarkId>& gone, const FrameDetections& dots, GreyImage picture) {
  for (const Detection& dot : dots.detections)
    if (gone.count(dot.mark) != 0) paint_out(dot, picture);
  return picture;
}

std::set<MarkId> random_marks(unsigned seed, std::size_t count) {
  std::mt19937 random(seed);
  std::set<MarkId> marks;
  while (marks.size() < count) {
    marks.insert({static_cast<int>(random() % 8), static_cast<int>(random() % 10)});
  }
  return marks;
}

/// The dots of photograph `k` as measured in it (tests/data/dot-grid-photos), drawn dark on grey,
/// for use without the photographs.
cv::Mat drawn(int k) {
  Drawing drawing(640, 480, 190);
  const Csv dots =
      read_csv(test_data("dot-grid-photos") / "ellipses.csv",
               {"photograph", "u_px", "v_px", "semi_major_px", "semi_minor_px", "angle_deg"});
  for (std::size_t i = 0; i < dots.lines.size(); ++i) {
    const auto& of = dots.columns;
    if (of[0][i] != k) continue;
    drawing.ellipse({of[1][i], of[2][i]}, {of[3][i], of[4][i]}, of[5][i], 40);
  }
  return drawing.picture(0.7);
}

/// Pictures of a pose: the drawn dots, and the photograph if available.
std::vector<GreyImage> pictures_of(int k) {
  std::vector<GreyImage> pictures{image_of(drawn(k))};
  if (const auto folder = reference_data("dot-grid-photos"))
    pictures.push_back(image_of(cv::imread(
        (*folder / ("image0000" + std::to_string(k) + ".jpg")).string(), cv::IMREAD_GRAYSCALE)));
  return pictures;
}

/// Checks that all dots are found and labelled consistently with a plane.
void expect_all_eighty(const std::vector<fs::path>& pictures) {
  const GridBench bench(pictures);
  const DetectResult result = detect::detect(bench.recording, bench.rig, bench.options);
  ASSERT_EQ(result.detections.frames.size(), static_cast<std::size_t>(photos));
  for (const FrameDetections& frame : result.detections.frames) {
    EXPECT_EQ(frame.detections.size(), 80U) << frame.set;
    EXPECT_TRUE(frame.islands.empty()) << frame.set;
    ASSERT_GE(frame.detections.size(), 8U);
    std::cout << frame.set << ": " << frame.detections.size() << " dots, largest distance from a "
              << "plane's view " << worst_in_pitches(frame.detections) << " pitches, sigma "
              << std::sqrt(frame.detections[40].covariance_px2.trace() / 2) << " px\n";
    // The lens bends lines by a few per cent of a pitch; a wrong index would add a whole pitch.
    EXPECT_LT(worst_in_pitches(frame.detections), 0.35) << frame.set;
  }
  ASSERT_FALSE(result.report.warnings.empty());
  EXPECT_THAT(result.report.warnings.back(), HasSubstr("upside down"));
}

TEST(DotGrid, AllEightyDotsOfSixPhotographsWithoutATag) {
  const TemporaryFolder folder;
  std::vector<fs::path> drawings, photographs;
  const auto at_hand = reference_data("dot-grid-photos");
  for (int k = 0; k < photos; ++k) {
    drawings.push_back(folder.path() / ("drawn" + std::to_string(k) + ".png"));
    cv::imwrite(drawings.back().string(), drawn(k));
    if (at_hand) photographs.push_back(*at_hand / ("image0000" + std::to_string(k) + ".jpg"));
  }
  expect_all_eighty(drawings);
  if (at_hand) expect_all_eighty(photographs);
}

PrintPlane grid_plane() {
  Target target;
  target.rows = 8;
  target.cols = 10;
  target.pitch_m = 0.025;
  target.dot_diameter_m = 0.015;
  return plane_of(target);
}

FrameDetections look(const GreyImage& image) {
  TagFinder no_tags("");
  return detect_frame(image, grid_plane(), no_tags, {});
}

void expect_the_rest(const FrameDetections& whole, const FrameDetections& rest,
                     const std::set<MarkId>& gone) {
  EXPECT_EQ(rest.detections.size(), 80 - gone.size());
  for (const Detection& dot : rest.detections) {
    const auto before = std::find_if(whole.detections.begin(), whole.detections.end(),
                                     [&](const Detection& d) { return d.mark == dot.mark; });
    ASSERT_NE(before, whole.detections.end());
    EXPECT_EQ(gone.count(dot.mark), 0U);
    // Paint over a neighbour can touch the ring used for fitting a dot.
    EXPECT_LT((before->centre_px - dot.centre_px).norm(), 1.0);
  }
}

TEST(DotGrid, AnyTenDotsMayBePaintedOut) {
  const int choices = trial_count(3, 40);
  for (int k = 0; k < photos; ++k) {
    for (const GreyImage& whole : pictures_of(k)) {
      const FrameDetections before = look(whole);
      ASSERT_EQ(before.detections.size(), 80U) << k;
      for (int choice = 0; choice < choices; ++choice) {
        SCOPED_TRACE("photograph " + std::to_string(k) + ", choice " + std::to_string(choice));
        const std::set<MarkId> gone = random_marks(100 * k + choice, 10);
        expect_the_rest(before, look(without(gone, before, whole)), gone);
      }
    }
  }
}

TEST(DotGrid, AnIsolatedCornerIsReachedOverTheHole) {
  // All dots within two steps of the corner (0, 0), and two others.
  const std::set<MarkId> gone = {{0, 1}, {0, 2}, {1, 0}, {1, 1}, {1, 2},
                                 {2, 0}, {2, 1}, {2, 2}, {5, 5}, {7, 9}};
  for (const GreyImage& whole : pictures_of(0)) {
    const FrameDetections before = look(whole);
    expect_the_rest(before, look(without(gone, before, whole)), gone);
  }
}

/// Checks that detections.json keeps the separate pieces.
void expect_kept(const FrameDetections& rest) {
  const TemporaryFolder out;
  Detections written;
  written.lattice = {Surface::target, 8, 10, 0.025, 0.015, {0, 0}, {0, 0}, "x"};
  written.frames = {rest};
  written.frames[0].set = "stage_z000";
  written.frames[0].camera = "cam0";
  write_detections(out.path() / "detections.json", written);
  const Detections back = read_detections(out.path() / "detections.json");
  ASSERT_EQ(back.frames[0].islands.size(), rest.islands.size());
  for (std::size_t k = 0; k < rest.islands.size(); ++k) {
    EXPECT_EQ(back.frames[0].islands[k].island, rest.islands[k].island);
    EXPECT_EQ(back.frames[0].islands[k].dot.mark, rest.islands[k].dot.mark);
    EXPECT_EQ(back.frames[0].islands[k].dot.centre_px, rest.islands[k].dot.centre_px);
  }
}

TEST(DotGrid, WithoutAWholeOuterColumnThePlaceIsNotGuessed) {
  std::set<MarkId> gone;
  for (int row = 0; row < 8; ++row) gone.insert({row, 0});
  for (const GreyImage& whole : pictures_of(0)) {
    const FrameDetections before = look(whole);
    const FrameDetections rest = look(without(gone, before, whole));
    EXPECT_TRUE(rest.detections.empty());
    EXPECT_EQ(rest.islands.size(), 72U);
    for (const IslandDot& dot : rest.islands) {
      const auto same = std::find_if(
          before.detections.begin(), before.detections.end(),
          [&](const Detection& d) { return (d.centre_px - dot.dot.centre_px).norm() < 1.0; });
      ASSERT_NE(same, before.detections.end());
    }
    expect_kept(rest);
  }
}

}  // namespace

// ----
// Plates of dots made unique by hollow dots, staggered grids and white dots: drawn from their
// descriptions, and plates for digital image correlation in DICe's pictures.

namespace {

Target read(const std::string& keys) {
  const TemporaryFolder folder;
  write_durable(folder.path() / "target.toml",
                "schema = \"drapebench/target/1\"\nkind = \"dot-grid\"\n" + keys);
  return read_target(folder.path() / "target.toml");
}

/// A face as pixels of 1/50 mm about its centre.
class Paper {
 public:
  explicit Paper(const Face& face) : dark_(kSide, kSide, CV_8S, cv::Scalar(0)) {
    for (const auto& boxes : face.areas)
      for (const FaceBox& box : boxes)
        fill(box.least, box.most, 1, [](const FacePoint&) { return true; });
    for (const FaceDisc& disc : face.discs) {
      const FacePoint reach = FacePoint::Constant(disc.radius_m);
      fill(disc.centre - reach, disc.centre + reach, disc.ink > 0 ? 1 : -1,
           [&](const FacePoint& at) { return (at - disc.centre).norm() < disc.radius_m; });
    }
  }
  [[nodiscard]] bool is_dark(const FacePoint& at) const {
    const cv::Point place = pixel(at);
    return place.inside({0, 0, kSide, kSide}) && dark_.at<signed char>(place) > 0;
  }

 private:
  static constexpr int kSide = 5000;
  static constexpr double kPixel_m = 0.02e-3;

  static cv::Point pixel(const FacePoint& at) {
    return {static_cast<int>(std::floor(at.x() / kPixel_m)) + kSide / 2,
            static_cast<int>(std::floor(at.y() / kPixel_m)) + kSide / 2};
  }
  template <class Inside>
  void fill(const FacePoint& least, const FacePoint& most, int ink, const Inside& inside) {
    const cv::Point from = pixel(least), to = pixel(most);
    for (int y = std::max(0, from.y); y <= std::min(kSide - 1, to.y); ++y)
      for (int x = std::max(0, from.x); x <= std::min(kSide - 1, to.x); ++x)
        if (inside(kPixel_m * FacePoint(x + 0.5 - kSide / 2, y + 0.5 - kSide / 2)))
          dark_.at<signed char>(y, x) += static_cast<signed char>(ink);
  }

  cv::Mat dark_;
};

/// An oblique and rotated view of a target's face.
struct View {
  Eigen::Matrix3d px_from_face;
  int width_px = 900, height_px = 700;

  View(double px_per_m, double turn_deg) {
    const double turn = turn_deg * std::acos(-1.0) / 180;
    Eigen::Matrix3d scaled, tilted = Eigen::Matrix3d::Identity();
    scaled << px_per_m * std::cos(turn), -px_per_m * std::sin(turn), 452.3,  //
        px_per_m * std::sin(turn), px_per_m * std::cos(turn), 348.6, 0, 0, 1;
    tilted(2, 0) = 1.5;
    tilted(2, 1) = -1;
    px_from_face = scaled * tilted;
  }

  [[nodiscard]] GreyImage picture(const Face& face, double dark = 45, double light = 190) const {
    const Paper paper(face);
    const Eigen::Matrix3d face_from_px = px_from_face.inverse();
    return exposed(sampled(width_px, height_px, 3,
                           [&](const Eigen::Vector2d& px) {
                             return paper.is_dark(mapped(face_from_px, px)) ? dark : light;
                           }),
                   0.7, 1.5, 5);
  }
  [[nodiscard]] GreyImage picture(const Target& target, double dark = 45,
                                  double light = 190) const {
    return picture(face_of(target), dark, light);
  }

  [[nodiscard]] Eigen::Vector2d px(const Target& target, MarkId mark) const {
    return mapped(px_from_face, face_point(target, mark));
  }
};

/// Checks that exactly the dots that are whole in the picture have labels, and the right ones.
void expect_all(const Target& target, const View& view, const FrameDetections& frame) {
  std::map<MarkId, Eigen::Vector2d> seen;
  for (const Detection& dot : frame.detections) seen[dot.mark] = dot.centre_px;
  int whole = 0;
  for (int row = 0; row < target.rows; ++row) {
    for (int col = 0; col < target.cols; ++col) {
      const MarkId mark{row, col};
      if (!target.has(mark)) {
        EXPECT_EQ(seen.count(mark), 0U);
        continue;
      }
      const Eigen::Vector2d at = view.px(target, mark);
      constexpr double kRoom_px = 12;
      if (at.minCoeff() < kRoom_px || at.x() > view.width_px - kRoom_px ||
          at.y() > view.height_px - kRoom_px)
        continue;
      ++whole;
      ASSERT_EQ(seen.count(mark), 1U) << row << ", " << col;
      EXPECT_LT((seen.at(mark) - at).norm(), 0.5) << row << ", " << col;
    }
  }
  EXPECT_GT(whole, 10);
}

FrameDetections look(const GreyImage& image, const Target& target) {
  TagFinder no_tags("");
  return detect_frame(image, plane_of(target), no_tags, {});
}

const char* kPlate =
    "rows = 12\ncols = 14\npitch_mm = 5\ndot_diameter_mm = 2\n"
    "hollow = [[2, 2], [2, 9], [7, 2]]\nhollow_diameter_mm = 0.7\n";

TEST(Plates, HollowDotsPlaceAPlateThatTheFrameCuts) {
  const Target target = read(kPlate);
  for (const double turn_deg : {-10.0, 80.0, 170.0, 265.0}) {
    SCOPED_TRACE(turn_deg);
    const View view(11'000, turn_deg);
    expect_all(target, view, look(view.picture(target), target));
  }
}

TEST(Plates, WhiteDotsOnABlackPlateAreReadAsTheyArePrinted) {
  const Target target = read(std::string(kPlate) + "dot_colour = \"white\"\n");
  const View view(11'000, 20);
  expect_all(target, view, look(view.picture(target), target));
  // Also in dim light, with dots at a third of the largest level.
  expect_all(target, view, look(view.picture(target, 8, 85), target));
}

TEST(Plates, AStaggeredGridIsLabelledByItsOwnRows) {
  const Target target =
      read("rows = 11\ncols = 8\npitch_mm = 7\ndot_diameter_mm = 5\narrangement = \"staggered\"\n");
  for (const double turn_deg : {0.0, 100.0, 190.0}) {
    SCOPED_TRACE(turn_deg);
    const View view(6'000, turn_deg);
    const FrameDetections frame = look(view.picture(target), target);
    EXPECT_EQ(frame.detections.size(), 44U);
    expect_all(target, view, frame);
    MarkLattice lattice;
    lattice.pitch_m = target.pitch_m;
    lattice.dot_diameter_m = target.dot_diameter_m;
    EXPECT_NEAR(dot_size_ratio({frame}, {0.7}, lattice).value(), 1, 0.02);
  }
}

TEST(Plates, AGridOfTwelveDotsIsRead) {
  const Target target = read("rows = 3\ncols = 4\npitch_mm = 20\ndot_diameter_mm = 10\n");
  const View view(6'000, 10);
  expect_all(target, view, look(view.picture(target), target));
}

TEST(Plates, AHollowDotOutsideThePictureIsNamedAsTheCause) {
  const Target target = read(kPlate);
  View view(11'000, -10);
  view.px_from_face.topRows<1>() -= 350 * view.px_from_face.bottomRows<1>();
  const GreyImage image = view.picture(target);
  const FrameDetections frame = look(image, target);
  EXPECT_TRUE(frame.detections.empty());
  EXPECT_GT(frame.islands.size(), 40U);
  EXPECT_THAT(why_no_mark(image, plane_of(target), {}, false, "plate.toml"),
              HasSubstr("no place of it shows all hollow dots of plate.toml"));
}

TEST(Plates, DotsOfTheOtherColourAreNamed) {
  const Target target = read(std::string(kPlate) + "dot_colour = \"white\"\n");
  const View view(11'000, 20);
  PrintPlane black = plane_of(target);
  black.white_dots = false;
  EXPECT_THAT(why_no_mark(view.picture(target), black, {}, false, "plate.toml"),
              HasSubstr("it shows white dots, plate.toml has black ones (dot_colour)"));
}

TEST(Plates, ADotBesideItsPlaceHasNoLabel) {
  // A drawing of the plate with one dot moved by 0.4 of a pitch.
  const Target target = read(kPlate);
  Face face = face_of(target);
  const View view(11'000, 0);
  for (FaceDisc& disc : face.discs)
    if ((disc.centre - face_point(target, {5, 6})).norm() < 1e-6) disc.centre.x() += 0.002;
  const FrameDetections frame = look(view.picture(face), target);
  EXPECT_FALSE(has(frame, {5, 6}));
  EXPECT_TRUE(has(frame, {5, 5}));
  EXPECT_TRUE(has(frame, {5, 7}));
}

/// Number of whole dots of a picture, counted by eye: at least half a pixel from its border.
struct Photograph {
  const char* file;
  std::size_t whole;
};

struct PlateInPictures {
  const char* keys;
  std::vector<Photograph> photographs[2];  ///< per camera
};

/// Checks that every whole dot is labelled, and that OpenCV's camera model fitted to all pictures
/// of a camera leaves residuals below a third of the pitch.
void expect_read(const PlateInPictures& plate) {
  const auto folder = reference_data("dic-dots");
  if (!folder) GTEST_SKIP() << "the reference data lack dic-dots";
  const Target target = read(plate.keys);
  for (const auto& photographs : plate.photographs) {
    std::vector<std::vector<cv::Point3f>> points;
    std::vector<std::vector<cv::Point2f>> seen;
    cv::Size size;
    for (const auto& [file, whole] : photographs) {
      SCOPED_TRACE(file);
      const cv::Mat picture = cv::imread((*folder / file).string(), cv::IMREAD_GRAYSCALE);
      ASSERT_FALSE(picture.empty());
      size = picture.size();
      const FrameDetections frame = look(image_of(picture), target);
      std::size_t inside = 0;
      points.emplace_back();
      seen.emplace_back();
      for (const Detection& dot : frame.detections) {
        const double c = std::cos(dot.axis_angle_rad), s = std::sin(dot.axis_angle_rad);
        const Eigen::Vector2d reach(std::hypot(dot.semi_axes_px.x() * c, dot.semi_axes_px.y() * s),
                                    std::hypot(dot.semi_axes_px.x() * s, dot.semi_axes_px.y() * c));
        inside += (dot.centre_px - reach).minCoeff() >= 0 &&
                  dot.centre_px.x() + reach.x() <= size.width - 1 &&
                  dot.centre_px.y() + reach.y() <= size.height - 1;
        points.back().emplace_back(target.pitch_m * 1e3 * dot.mark.col,
                                   target.pitch_m * 1e3 * dot.mark.row, 0);
        seen.back().emplace_back(dot.centre_px.x(), dot.centre_px.y());
      }
      EXPECT_GE(inside, whole);
    }
    cv::Mat camera, lens;
    std::vector<cv::Mat> turns, shifts;
    cv::calibrateCamera(points, seen, size, camera, lens, turns, shifts,
                        cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3);
    double worst = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::vector<cv::Point2f> expected;
      cv::projectPoints(points[i], turns[i], shifts[i], camera, lens, expected);
      const double pitch_px =
          camera.at<double>(0, 0) * target.pitch_m * 1e3 / shifts[i].at<double>(2);
      for (std::size_t k = 0; k < expected.size(); ++k)
        worst = std::max(worst, cv::norm(expected[k] - seen[i][k]) / pitch_px);
    }
    std::cout << "largest residual " << worst << " pitches\n";
    EXPECT_LT(worst, 1.0 / 3);
  }
}

TEST(Plates, EveryWholeDotOfDicesDrawnPicturesIsLabelled) {
  expect_read(
      {"rows = 10\ncols = 14\npitch_mm = 7\ndot_diameter_mm = 2\n"
       "hollow = [[2, 2], [2, 11], [7, 2]]\nhollow_diameter_mm = 0.7\n",
       {{{"simulated/dot_00_0.jpeg", 130},
         {"simulated/dot_01_0.jpeg", 119},
         {"simulated/dot_02_0.jpeg", 130},
         {"simulated/dot_03_0.jpeg", 127},
         {"simulated/dot_04_0.jpeg", 133}},
        {{"simulated/dot_00_1.jpeg", 131},
         {"simulated/dot_01_1.jpeg", 119},
         {"simulated/dot_02_1.jpeg", 128},
         {"simulated/dot_03_1.jpeg", 127},
         {"simulated/dot_04_1.jpeg", 125}}}});
}

TEST(Plates, EveryWholeDotOfARealPlateIsLabelled) {
  expect_read(
      {"rows = 30\ncols = 30\npitch_mm = 3.5\ndot_diameter_mm = 1.4\n"
       "hollow = [[12, 12], [12, 17], [15, 12]]\nhollow_diameter_mm = 0.5\n",
       {{{"real/CalB-sys2-0001_0.jpeg", 80},
         {"real/CalB-sys2-0002_0.jpeg", 80},
         {"real/CalB-sys2-0003_0.jpeg", 82},
         {"real/CalB-sys2-0004_0.jpeg", 82},
         {"real/CalB-sys2-0005_0.jpeg", 82},
         {"real/CalB-sys2-0006_0.jpeg", 82}},
        {{"real/CalB-sys2-0001_1.jpeg", 81},
         {"real/CalB-sys2-0002_1.jpeg", 80},
         {"real/CalB-sys2-0003_1.jpeg", 88},
         {"real/CalB-sys2-0004_1.jpeg", 85},
         {"real/CalB-sys2-0005_1.jpeg", 88},
         {"real/CalB-sys2-0006_1.jpeg", 87}}}});
}

}  // namespace
}  // namespace drape::test

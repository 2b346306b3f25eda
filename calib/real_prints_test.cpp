// SPDX-License-Identifier: Apache-2.0
// Targets that deviate from their drawings: real prints with a known answer, and simulated ones.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using units::mm;

/// A recording of a board: its rig, target and detections.
struct Recorded {
  Rig rig;
  Target target;
  Detections detections;

  [[nodiscard]] JointResult calibrated(const JointOptions& options = {}) const {
    return calibrate_joint(detections, rig, target, options);
  }
};

std::optional<Recorded> recorded(const std::string& folder) {
  const auto at = test::reference_data(folder);
  if (!at) return std::nullopt;
  Recorded board{read_rig(*at / "rig.toml"), {}, read_detections(*at / "target-detections.json")};
  board.target = read_target(board.rig.target_file);
  return board;
}

#define RECORDED(name, folder)                                             \
  const auto found_##name = recorded(folder);                              \
  if (!found_##name) GTEST_SKIP() << "the reference data lack " << folder; \
  Recorded name = *found_##name

const BrownLens& lens_of(const JointResult& result, std::size_t camera) {
  return std::get<BrownLens>(result.calibration.cameras[camera].camera.model.lens);
}

double length_mm(const MeasuredPlate& plate, const Target& target, MarkId a, MarkId b) {
  const auto at = [&](MarkId mark) {
    return plate.points_m[static_cast<std::size_t>(place_of(target, mark))];
  };
  return (at(a) - at(b)).norm() / mm;
}

// OpenCV's calibrateCameraRO on all 60 views of the set: f 3040.8, 3040.5, centre (615.6, 532.6).
TEST(RealPrints, CalibrelsCameraIsFoundThoughItsBoardIsNotAsDrawn) {
  RECORDED(board, "real-boards/calibrel-1");
  // Caliper measurement between the outer corners, uncertain by 0.1 mm; p1-p2 gives the scale.
  board.target.known_lengths = {{{9, 0}, {9, 15}, 224.14 * mm, 0.1 * mm}};
  const JointResult result = board.calibrated();
  EXPECT_EQ(result.report.status, "good");
  EXPECT_EQ(result.report.board, BoardKind::free);
  const double truth[] = {3040.8, 3040.5, 615.6, 532.6};
  const BrownLens& lens = lens_of(result, 0);
  const double found[] = {lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px};
  for (int i = 0; i < 4; ++i)
    EXPECT_LT(std::abs(found[i] - truth[i]),
              1.96 * std::sqrt(result.calibration.cameras[0].covariance(i, i)))
        << i;
  ASSERT_TRUE(result.report.plate.has_value());
  const auto length = [&](MarkId a, MarkId b) {
    return length_mm(*result.report.plate, board.target, a, b);
  };
  const MarkId p1{9, 0}, p2{9, 15}, p3{0, 0}, p4{0, 15};
  EXPECT_NEAR(length(p1, p2), 224.14, 0.05);
  EXPECT_NEAR(length(p1, p3), 135.35, 0.25);
  EXPECT_NEAR(length(p1, p4), 261.85, 0.25);
  EXPECT_NEAR(length(p2, p3), 262.00, 0.25);
  EXPECT_NEAR(length(p2, p4), 135.13, 0.25);
  EXPECT_NEAR(length(p3, p4), 224.73, 0.25);
  EXPECT_THAT(result.report.warnings, Contains(HasSubstr("the print is 0.39")));
}

TEST(RealPrints, TheMeasuredPlateServesAnotherCalibration) {
  RECORDED(board, "real-boards/calibrel-1");
  Recorded first = board, second = board;
  first.rig.free_poses.resize(12);
  second.rig.free_poses.erase(second.rig.free_poses.begin(), second.rig.free_poses.begin() + 12);
  const JointResult measured = first.calibrated();
  ASSERT_TRUE(measured.report.plate.has_value());
  test::TemporaryFolder folder;
  Value root = board.target.document.root();
  root["measured"] = value_of(*measured.report.plate);
  write_value(folder.path() / "plate.toml", root);
  second.target = read_target(folder.path() / "plate.toml");
  ASSERT_TRUE(second.target.measured.has_value());
  const JointResult result = second.calibrated();
  EXPECT_EQ(result.report.status, "good");
  EXPECT_NEAR(lens_of(result, 0).cy_px, 532.6,
              3 * std::sqrt(result.calibration.cameras[0].covariance(3, 3)));
  EXPECT_LT(result.report.rms_px, 0.05);
}

TEST(RealPrints, BoardsOfOtherToolsAreGo) {
  for (const char* folder : {"real-boards/trinocular-boofcv", "real-boards/multidic-201"}) {
    RECORDED(board, folder);
    const JointResult result = board.calibrated();
    EXPECT_EQ(result.report.status, "good") << folder;
    EXPECT_EQ(result.report.board, BoardKind::free) << folder;
  }
}

TEST(RealPrints, TangentialLensesAccuseNoCameraInAnyOrderOfTheViews) {
  RECORDED(board, "drawn-boards/tangential");
  std::mt19937 random(1);
  for (int order = 0; order < 3; ++order) {
    const JointResult result = board.calibrated();
    EXPECT_EQ(result.report.status, "good") << order;
    EXPECT_EQ(result.report.lens, LensTerms::k1_k2_p1_p2) << order;
    EXPECT_EQ(result.report.board, BoardKind::bow) << order;
    for (std::size_t i = board.rig.free_poses.size() - 1; i > 0; --i)
      std::swap(board.rig.free_poses[i], board.rig.free_poses[random() % (i + 1)]);
  }
}

TEST(RealPrints, AStretchedPrintIsToldFromPixelsThatAreNotSquare) {
  RECORDED(board, "drawn-boards/print-0.4-percent");
  JointResult result = board.calibrated();
  EXPECT_EQ(result.report.status, "good");
  EXPECT_THAT(result.report.warnings, Contains(HasSubstr("the print is 0.40")));
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(lens_of(result, c).fy_px / lens_of(result, c).fx_px, 1, 5e-4) << c;
  JointOptions as_drawn;
  as_drawn.board = BoardKind::bow;
  result = board.calibrated(as_drawn);
  EXPECT_EQ(result.report.status, "good");
  EXPECT_THAT(result.report.warnings, Contains(HasSubstr("fy/fx is 1.0040")));
  for (RigCamera& camera : board.rig.cameras) camera.square_pixels = 1e-4;
  result = board.calibrated(as_drawn);
  EXPECT_THAT(result.report.status, HasSubstr("which rig.toml promises"));
  EXPECT_EQ(board.calibrated().report.status, "good");
}

/// The invented bench with a print whose points are off by `error_mm` along x and y.
JointModel printed(unsigned seed, double error_mm) {
  JointModel model = test::SyntheticBench(seed, 12).true_model();
  Board& board = model.board;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, error_mm);
  for (int dot = 0; dot < 108; ++dot) {
    board.drawn.emplace_back((dot % 12 - 5.5) * 0.02, (dot / 12 - 4) * 0.02, 0);
    board.point_sd_mm.emplace_back(0.2, 0.2, 0.2);
    board.shift_mm.emplace_back(normal(random), normal(random), 0);
  }
  board.information(2, 2) = board.information(3, 3) = 1 / (print_sd * print_sd);
  for (JointFrame& frame : model.frames) {
    for (TargetPoint& point : frame.points) {
      const Eigen::Vector2d noise = point.measured_px - *pixel_of(model, frame, point);
      point.place = point.dot.row * 12 + point.dot.col;
      point.measured_px = *pixel_of(model, frame, point) + noise;
    }
  }
  return model;
}

// A plate larger than the picture: its other points say nothing of the print's error.
TEST(RealPrints, PointsOutOfViewDoNotDiluteThePrintsError) {
  double print_rms_mm[2], focal_sd_px[2];
  for (const int further : {0, 1}) {
    JointModel views = test::forgotten(printed(7, 0.05));
    views.board.shift_mm.clear();
    for (int i = 0; i < 900 * further; ++i) {
      views.board.drawn.emplace_back(0.2 + 0.02 * (i % 30), 0.02 * (i / 30), 0);
      views.board.point_sd_mm.emplace_back(0.2, 0.2, 0.2);
    }
    start_joint(views);
    JointOptions options;
    options.lens = LensTerms::k1_k2;
    options.board = BoardKind::free;
    const JointResult result = calibrate_joint(views, 0, options);
    EXPECT_EQ(result.report.status, "good");
    print_rms_mm[further] = result.report.print_rms_mm;
    focal_sd_px[further] = result.report.cameras[0].focal_sd_px;
  }
  // The estimate of the print's error settles to 5 %.
  EXPECT_NEAR(print_rms_mm[1] / print_rms_mm[0], 1, 0.05);
  EXPECT_NEAR(focal_sd_px[1] / focal_sd_px[0], 1, 0.05);
}

TEST(RealPrints, APrintsErrorIsFoundAndStated) {
  for (const double error_mm : {0.0, 0.05}) {
    const JointModel truth = printed(7, error_mm);
    JointModel views = test::forgotten(truth);
    views.board.shift_mm.clear();
    start_joint(views);
    JointOptions options;
    options.lens = LensTerms::k1_k2;
    const JointResult result = calibrate_joint(views, 0, options);
    EXPECT_EQ(result.report.status, "good");
    EXPECT_EQ(result.report.board, error_mm > 0 ? BoardKind::free : BoardKind::bow);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto& lens = std::get<BrownLens>(truth.cameras[c].camera.model.lens);
      EXPECT_NEAR(lens_of(result, c).fx_px, lens.fx_px,
                  4 * std::sqrt(result.calibration.cameras[c].covariance(0, 0)))
          << c;
    }
    // The target's share is a part of each variance, larger of a print that may err anyhow.
    const auto& all = result.calibration.joint_covariance;
    const auto& target = result.calibration.target_covariance;
    for (const int centre : {2, 3}) {
      EXPECT_GT(target(centre, centre), 0);
      EXPECT_LT(target(centre, centre), all(centre, centre));
    }
    EXPECT_EQ(result.report.plate.has_value(), error_mm > 0);
    if (!result.report.plate) continue;
    double squares = 0;
    for (std::size_t i = 0; i < truth.board.drawn.size(); ++i)
      squares += (result.report.plate->points_m[i] -
                  truth.board.bent(truth.board.drawn[i], static_cast<int>(i)))
                     .head<2>()
                     .squaredNorm() /
                 static_cast<double>(2 * truth.board.drawn.size());
    EXPECT_LT(std::sqrt(squares) / mm, error_mm / 4);
  }
}

}  // namespace
}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
// Thirteen real stereo pairs of a chessboard (Bouguet's, distributed with OpenCV), processed by the
// programs as by a person: boards drawn from the corners that OpenCV 4.6 found with its best
// sub-pixel window, and the photographs if available. The limits are the errors of OpenCV on these
// corners and of mrcal 2.2 with the board's bow.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/files/json_file.hpp"
#include "core/rig.hpp"
#include "core/units.hpp"
#include "tests/support/drawing.hpp"
#include "tests/support/paths.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;

constexpr int kRows = 6, kCols = 9;
constexpr double kSquare_m = 0.03;

/// RMS distance of points over all cameras, px.
double rms_px(const Calibration& calibration) {
  double squares = 0;
  int points = 0;
  for (const CalibratedCamera& camera : calibration.cameras) {
    squares += camera.residuals.points * std::pow(camera.residuals.rms_px, 2);
    points += camera.residuals.points;
  }
  return std::sqrt(squares / points);
}

class StereoChessboard : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(program("drape"))) GTEST_SKIP() << "missing: the program `drape`";
    draw_stereo_chessboard(drawn_);
  }

  /// Folders to which the limits apply.
  [[nodiscard]] std::vector<fs::path> all_pictures() const {
    std::vector<fs::path> folders{drawn_};
    if (const auto photographs = reference_data("stereo-chessboard"))
      folders.push_back(*photographs);
    return folders;
  }

  [[nodiscard]] Calibration calibrate(const fs::path& folder, const std::string& name) const {
    fs::remove_all(out() / name);
    const Outcome outcome =
        run_line(program("drape").string() + " calib images " + folder.string() +
                 " --board 9x6 --square-mm 30 --out " + (out() / name).string());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
    return read_calibration(out() / name / "calibration.json");
  }

  /// Calibrates from the detections of `name` again with another rig file and options.
  [[nodiscard]] Calibration again(const std::string& name, const fs::path& rig,
                                  const std::string& options) const {
    const fs::path file = out() / name / "again.json";
    const Outcome outcome = run_line(
        program("drape-calib").string() + " " + (out() / name / "detections.json").string() +
        " --rig " + rig.string() + " --method joint " + options + " --out " + file.string());
    EXPECT_LE(outcome.exit_code, 1) << outcome.text;
    return read_calibration(file);
  }

  /// Copy of `folder` with the pictures of one camera.
  [[nodiscard]] fs::path only(const std::string& camera, const fs::path& pictures,
                              const fs::path& folder) const {
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const auto& entry : fs::directory_iterator(pictures)) {
      const fs::path name = entry.path().filename();
      if (name.string().starts_with(camera) &&
          (name.extension() == ".jpg" || name.extension() == ".png"))
        fs::create_symlink(fs::canonical(entry.path()), folder / name);
    }
    return folder;
  }

  [[nodiscard]] const fs::path& out() const { return folder_.path(); }

  TemporaryFolder folder_;
  const fs::path drawn_ = folder_.path() / "drawn";
};

TEST_F(StereoChessboard, OneCameraIsNotAboveOpenCv) {
  for (const fs::path& pictures : all_pictures()) {
    const auto rms_of = [&](const std::string& camera) {
      return rms_px(calibrate(only(camera, pictures, out() / "one"), camera));
    };
    EXPECT_LE(rms_of("left"), 0.1954) << pictures;
    EXPECT_LE(rms_of("right"), 0.2070) << pictures;
  }
}

TEST_F(StereoChessboard, ThePairIsNotAboveOpenCvAndWithTheBoardsBowNotAboveMrcal) {
  for (const fs::path& pictures : all_pictures()) {
    EXPECT_LE(rms_px(calibrate(pictures, "pair")), 0.2081) << pictures;
    EXPECT_LE(rms_px(again("pair", out() / "pair/rig.toml", "--board drawn")), 0.2150) << pictures;
  }
}

TEST_F(StereoChessboard, TheBaselineIsThePublishedOne) {
  for (const fs::path& pictures : all_pictures()) {
    const Calibration calibration = calibrate(pictures, "pair");
    const auto right_from_left = calibration.camera("right").camera.cam_from_world *
                                 calibration.camera("left").camera.cam_from_world.inverse();
    // Bouguet's published translation, with three times his standard deviations.
    const Eigen::Vector3d published_mm(-99.80198, 1.12443, 0.05041);
    const Eigen::Vector3d three_sd_mm(0.142, 0.114, 0.498);
    const Eigen::Vector3d difference_mm = right_from_left.translation_m / units::mm - published_mm;
    EXPECT_LT((difference_mm.array().abs() / three_sd_mm.array()).maxCoeff(), 1.0)
        << difference_mm.transpose() << ", " << pictures;
  }
}

TEST_F(StereoChessboard, AFolderOfSomebodysOwnIsNotTouched) {
  write_durable(out() / "mine/rig.toml", "precious");
  const Outcome outcome =
      run_line(program("drape").string() + " calib images " + drawn_.string() +
               " --board 9x6 --square-mm 30 --out " + (out() / "mine").string());
  EXPECT_EQ(outcome.exit_code, 3) << outcome.text;
  EXPECT_EQ(read_text(out() / "mine/rig.toml"), "precious");
  EXPECT_EQ(std::distance(fs::directory_iterator(out() / "mine"), {}), 1);
}

TEST_F(StereoChessboard, ACameraMayHaveAnyNameThatAFileCanHave) {
  const fs::path folder = out() / "named";
  static_cast<void>(only("left", drawn_, folder / "le \"ft\" \u00e4"));
  const Outcome outcome = run_line(program("drape").string() + " calib images " + folder.string() +
                                   " --board 9x6 --square-mm 30 --out " + (out() / "any").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.text;
  EXPECT_EQ(read_calibration(out() / "any/calibration.json").cameras.at(0).camera.name,
            "le \"ft\" \u00e4");
}

TEST_F(StereoChessboard, WhatTheStagesWarnOfStandsInTheEndingAndNothingOfAnEarlierRunStays) {
  const fs::path narrow = out() / "narrow";
  draw_stereo_chessboard(narrow, 8);
  cv::imwrite((narrow / "left01.png").string(), Drawing(640, 480, 200).picture(0.7));
  const auto run = [&](const std::string& options) {
    return run_line(program("drape").string() + " calib images " + narrow.string() + " --out " +
                    (out() / "o").string() + " --square-mm 30 --json " + options);
  };
  const Outcome smaller = run("--board 8x6");
  const Json ending = parse_json(smaller.text);
  EXPECT_THAT(ending["warnings"].dump(),
              testing::HasSubstr("detect: the chessboard looks the same"));
  EXPECT_THAT(ending["rejected"].dump(), testing::HasSubstr("calib: set view_01, left"));
  EXPECT_TRUE(fs::exists(out() / "o/calibration.json"));
  EXPECT_EQ(run("--board 8x6 --thickness-mm -5").exit_code, 2);
  EXPECT_EQ(run("--board 8x6 --lens-from " + (out() / "o/calibration.json").string()).exit_code, 2);
  EXPECT_TRUE(fs::exists(out() / "o/calibration.json")) << "a wrong call removes nothing";
  EXPECT_EQ(run_line(program("drape").string() +
                     " calib images nothing --board 9x6 --square-mm 30 "
                     "--out " +
                     (out() / "o").string())
                .exit_code,
            3);
  EXPECT_TRUE(fs::exists(out() / "o/calibration.json")) << "nor a folder that is not there";
  for (const char* own : {"o/recording", "o/recording/view_01"})
    EXPECT_EQ(run_line(program("drape").string() + " calib images " + (out() / own).string() +
                       " --board 9x6 --square-mm 30 --out " + (out() / "o").string())
                  .exit_code,
              2)
        << own;
  EXPECT_EQ(run("--board 30x20").exit_code, 3);
  EXPECT_FALSE(fs::exists(out() / "o/calibration.json"));
  EXPECT_FALSE(fs::exists(out() / "o/calibration.run.json"));
}

/// The point nearest to both rays.
Eigen::Vector3d midpoint(const Camera& a, const Eigen::Vector2d& a_px, const Camera& b,
                         const Eigen::Vector2d& b_px) {
  const Eigen::Vector3d origin_a = centre_in_world(a), origin_b = centre_in_world(b);
  const Eigen::Vector3d ray_a =
      a.cam_from_world.rotation.transpose() * unproject(a.model, a_px).value();
  const Eigen::Vector3d ray_b =
      b.cam_from_world.rotation.transpose() * unproject(b.model, b_px).value();
  Eigen::Matrix<double, 3, 2> rays;
  rays << ray_a, -ray_b;
  const Eigen::Vector2d along = rays.colPivHouseholderQr().solve(origin_b - origin_a);
  return 0.5 * (origin_a + along[0] * ray_a + origin_b + along[1] * ray_b);
}

const FrameDetections& frame_of(const Detections& detections, const std::string& set,
                                const std::string& camera) {
  for (const FrameDetections& frame : detections.frames)
    if (frame.set == set && frame.camera == camera) return frame;
  throw std::runtime_error("no frame of " + set + ", " + camera);
}

/// Sum of squared distances, mm^2, of the triangulated corners from a flat board fitted to them.
double rigid_misfit_mm2(const Calibration& calibration, const Detections& detections,
                        const std::string& set) {
  const FrameDetections& left = frame_of(detections, set, "left");
  const FrameDetections& right = frame_of(detections, set, "right");
  Eigen::Matrix3Xd board(3, kRows * kCols), measured(3, kRows * kCols);
  for (Eigen::Index i = 0; i < board.cols(); ++i) {
    const Detection& corner = left.detections.at(static_cast<std::size_t>(i));
    const Detection& other = right.detections.at(static_cast<std::size_t>(i));
    EXPECT_EQ(corner.mark, other.mark);
    board.col(i) << corner.mark.col * kSquare_m, corner.mark.row * kSquare_m, 0;
    measured.col(i) = midpoint(calibration.camera("left").camera, corner.centre_px,
                               calibration.camera("right").camera, other.centre_px);
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(board, measured, false);
  return ((fit.topLeftCorner<3, 3>() * board).colwise() + fit.topRightCorner<3, 1>() - measured)
             .squaredNorm() /
         (units::mm * units::mm);
}

TEST_F(StereoChessboard, ABoardThatCalibrationNeverSawKeepsItsShape) {
  for (const fs::path& pictures : all_pictures()) {
    static_cast<void>(calibrate(pictures, "pair"));
    const Detections detections = read_detections(out() / "pair/detections.json");
    const Rig rig = read_rig(out() / "pair/rig.toml");
    double squares = 0;
    int corners = 0;
    for (const FrameDetections& frame : detections.frames) {
      if (frame.camera != "left") continue;
      Rig without = rig;
      ASSERT_EQ(std::erase(without.free_poses, frame.set), 1U);
      const fs::path file = out() / "pair/without.toml";
      write_durable(file, text_of(without));
      squares += rigid_misfit_mm2(again("pair", file, "--lens k1k2p1p2"), detections, frame.set);
      corners += kRows * kCols;
    }
    ASSERT_EQ(corners, 13 * kRows * kCols);
    // OpenCV with its best window: 0.512 mm.
    EXPECT_LE(std::sqrt(squares / corners), 0.512) << pictures;
    RecordProperty("rigid_fit_rms_mm_" + pictures.filename().string(),
                   std::to_string(std::sqrt(squares / corners)));
  }
}

}  // namespace
}  // namespace drape::test

// SPDX-License-Identifier: Apache-2.0
// Every kind of target as drawn by `drape print`, photographed by two known cameras, and processed
// by the programs as by a person: import, detect, calib. Compares corners and dots with their true
// positions, and cameras with the true ones.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "core/calibration.hpp"
#include "core/detections.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/conformance/board_picture.hpp"
#include "tests/support/small_bench.hpp"

namespace drape::test {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::deg;
using units::mm;

/// A camera at (x, y, z) in metres that faces the centre of the target.
Camera camera_at(const std::string& name, const Vector3d& centre, const BrownLens& lens) {
  Camera camera;
  camera.name = name;
  camera.model = {lens, 960, 720};
  const Vector3d forward = (Vector3d(0, 0, 0.02) - centre).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  camera.cam_from_world.rotation << right.transpose(), forward.cross(right).transpose(),
      forward.transpose();
  camera.cam_from_world.translation_m = -(camera.cam_from_world.rotation * centre);
  return camera;
}

std::vector<Camera> true_cameras() {
  return {
      camera_at("cam0", {0.05, -0.32, 0.42}, {1240, 1238, 486.3, 352.8, -0.12, 0.03, 0, 0, 0}),
      camera_at("cam1", {-0.24, -0.22, 0.43}, {1263, 1262, 471.9, 366.4, -0.10, 0.02, 0, 0, 0})};
}

struct View {
  std::string set;
  WorldFromTarget world_from_target;
};

/// Two heights of the stage, then free poses about several axes.
std::vector<View> views() {
  std::vector<View> result;
  for (const double z_mm : {0.0, 50.0}) {
    View view{"stage" + std::to_string(result.size()), {}};
    view.world_from_target.translation_m.z() = z_mm * mm;
    result.push_back(view);
  }
  for (const auto& [tilt_deg, about_deg] : {std::pair(25.0, 10.0), std::pair(15.0, 130.0),
                                            std::pair(25.0, 250.0), std::pair(20.0, 70.0)}) {
    View view{"pose" + std::to_string(result.size()), {}};
    const Vector3d axis(std::cos(about_deg * deg), std::sin(about_deg * deg), 0);
    view.world_from_target.rotation =
        Eigen::AngleAxisd(tilt_deg * deg, axis).toRotationMatrix() *
        Eigen::AngleAxisd((about_deg - 90) / 9 * deg, Vector3d::UnitZ()).toRotationMatrix();
    view.world_from_target.translation_m = Vector3d(0, 0, 20 * mm);
    result.push_back(view);
  }
  return result;
}

constexpr const char* kRig = R"(schema = "drapebench/rig/1"
name = "bench"
target = "target.toml"
recording = "recording"
[calibration]
free_poses = ["pose2", "pose3", "pose4", "pose5"]
[[calibration.stage]]
set = "stage0"
z_mm = 0.0
[[calibration.stage]]
set = "stage1"
z_mm = 50.0
[[camera]]
name = "cam0"
width_px = 960
height_px = 720
pixel_pitch_um = [3.45, 3.45]
[[camera]]
name = "cam1"
width_px = 960
height_px = 720
pixel_pitch_um = [3.45, 3.45]
)";

class Boards : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"drape", "drape-capture", "drape-detect", "drape-calib"})
      if (!fs::exists(program(name)))
        GTEST_SKIP() << name << " is missing: build with stages capture, detect and calib too";
  }

  [[nodiscard]] fs::path at(const std::string& name) const { return folder_.path() / name; }

  void run(const std::string& arguments) const {
    const Outcome outcome = run_line((program("") / arguments).string());
    EXPECT_EQ(outcome.exit_code, 0) << arguments << "\n" << outcome.text;
  }

  /// Draws the printed page in every view, imports the pictures and detects the target's points.
  void photograph(const std::string& description) {
    write_durable(at("target.toml"), "schema = \"drapebench/target/1\"\n" + description);
    write_durable(at("rig.toml"), kRig);
    target_ = read_target(at("target.toml"));
    const PrintedPage printed = page_of(target_, "board", Paper::fit);
    unsigned seed = 11;
    for (const Camera& camera : true_cameras()) {
      const std::vector<Vector3d> rays = corner_rays(camera);
      for (const View& view : views()) {
        fs::create_directories(at("pictures") / view.set);
        const cv::Mat picture = picture_of(printed, camera, rays, view.world_from_target, ++seed);
        cv::imwrite((at("pictures") / view.set / (camera.name + ".png")).string(), picture);
      }
    }
    run("drape import " + at("pictures").string() + " --out " + at("recording").string());
    run("drape-detect " + at("recording").string() + " --rig " + at("rig.toml").string() +
        " --surface target --out " + at("detections.json").string());
  }

  [[nodiscard]] Calibration calibrated(const std::string& method) const {
    run("drape-calib " + at("detections.json").string() + " --rig " + at("rig.toml").string() +
        " --method " + method + " --out " + at(method + ".json").string());
    return read_calibration(at(method + ".json"));
  }

  /// RMS distance of the points found from their true positions. A corner with too little room
  /// around it, or to which no tag leads, may be missing; a wrong label must not occur.
  [[nodiscard]] double point_error_px() const {
    double squares = 0;
    std::size_t points = 0;
    const auto cameras = true_cameras();
    for (const FrameDetections& frame : read_detections(at("detections.json")).frames) {
      EXPECT_GE(frame.detections.size(), 0.75 * target_.rows * target_.cols)
          << frame.set << " " << frame.camera;
      for (const View& view : views()) {
        if (view.set != frame.set) continue;
        const Camera& camera = cameras.at(frame.camera == "cam0" ? 0 : 1);
        for (const Detection& point : frame.detections) {
          const Vector3d in_world = view.world_from_target * target_.point_in_target(point.mark);
          const auto image = project(camera.model, camera.cam_from_world * in_world);
          const double off_px = (point.centre_px - image->px).norm();
          EXPECT_LT(off_px, 0.5) << frame.set << " " << frame.camera << " (" << point.mark.row
                                 << ", " << point.mark.col << ") at "
                                 << point.centre_px.transpose();
          squares += off_px * off_px;
          ++points;
        }
      }
    }
    std::printf("  %zu of %d points found\n", points, 12 * target_.rows * target_.cols);
    EXPECT_GE(points, 0.95 * 12 * target_.rows * target_.cols);
    return std::sqrt(squares / static_cast<double>(points));
  }

  void expect_found_and_calibrated(const std::string& description, double most_rms_px);

 private:
  TemporaryFolder folder_;
  Target target_;
};

/// Compares a calibration with the true camera. Four standard deviations: exceeded once in 16,000
/// for each value.
void expect_true(const CalibratedCamera& calibrated, const Camera& truth) {
  const auto& found = std::get<BrownLens>(calibrated.camera.model.lens);
  const auto& lens = std::get<BrownLens>(truth.model.lens);
  const Eigen::Vector4d off(found.fx_px - lens.fx_px, found.fy_px - lens.fy_px,
                            found.cx_px - lens.cx_px, found.cy_px - lens.cy_px);
  const Eigen::Vector4d sd = calibrated.covariance.diagonal().head<4>().cwiseSqrt();
  const double centre_mm =
      (centre_in_world(calibrated.camera) - centre_in_world(truth)).norm() / mm;
  std::printf(
      "  %s: f off by %+.2f %+.2f +- %.2f %.2f px, image centre by %+.2f %+.2f +- %.2f %.2f px, "
      "camera centre by %.3f mm, RMS %.4f px\n",
      truth.name.c_str(), off[0], off[1], sd[0], sd[1], off[2], off[3], sd[2], sd[3], centre_mm,
      calibrated.residuals.rms_px);
  for (int i = 0; i < 4; ++i) EXPECT_LT(std::abs(off[i]), 4 * sd[i]) << truth.name << " " << i;
  // A large standard deviation would allow anything: the focal length is known to 0.1 %.
  EXPECT_LT(sd.head<2>().maxCoeff(), 1e-3 * lens.fx_px) << truth.name;
  EXPECT_LT(centre_mm, 0.5) << truth.name;
}

void Boards::expect_found_and_calibrated(const std::string& description, double most_rms_px) {
  photograph(description);
  const double error_px = point_error_px();
  std::printf("%s", description.substr(0, description.find('\n') + 1).c_str());
  std::printf("  points off by %.4f px RMS\n", error_px);
  EXPECT_LT(error_px, most_rms_px);
  const Calibration joint = calibrated("joint");
  const auto truth = true_cameras();
  ASSERT_EQ(joint.cameras.size(), truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    expect_true(joint.cameras[i], truth[i]);
    // A dot's eccentricity, an error of the point, is corrected in the fit.
    EXPECT_LT(joint.cameras[i].residuals.rms_px, 0.05);
  }
  // Tsai's method uses the two stages and one radial coefficient: a millimetre at half a metre.
  const Calibration tsai = calibrated("tsai");
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off_mm =
        (centre_in_world(tsai.cameras.at(i).camera) - centre_in_world(truth[i])).norm() / mm;
    std::printf("  %s by Tsai's method: camera centre off by %.3f mm\n", truth[i].name.c_str(),
                off_mm);
    EXPECT_LT(off_mm, 1.5) << truth[i].name;
  }
}

TEST_F(Boards, AChessboardIsFoundAndCalibrates) {
  expect_found_and_calibrated("kind = \"chessboard\"\nrows = 6\ncols = 9\npitch_mm = 24\n", 0.05);
}

TEST_F(Boards, ACharucoBoardIsFoundAndCalibrates) {
  expect_found_and_calibrated(
      "kind = \"charuco\"\nrows = 5\ncols = 7\npitch_mm = 30\n"
      "[tags]\nfamily = \"tag36h11\"\nedge_mm = 21\n",
      0.05);
}

TEST_F(Boards, AnAprilGridIsFoundAndCalibrates) {
  expect_found_and_calibrated(
      "kind = \"aprilgrid\"\nrows = 4\ncols = 6\npitch_mm = 39\n"
      "[tags]\nfamily = \"tag36h11\"\nedge_mm = 30\nborder_modules = 2\n",
      0.05);
}

/// Both ways: a grid of Kalibr's, whose border has two modules, described as having one, and the
/// reverse.
TEST_F(Boards, AnAprilGridOfAnotherBorderIsNamedByItsKey) {
  const std::string grid =
      "kind = \"aprilgrid\"\nrows = 4\ncols = 6\npitch_mm = 39\n"
      "[tags]\nfamily = \"tag36h11\"\nedge_mm = 30\nborder_modules = ";
  for (const auto& [printed, stated] : {std::pair("2", "1"), std::pair("1", "2")}) {
    photograph(grid + printed + "\n");
    write_durable(at("target.toml"), "schema = \"drapebench/target/1\"\n" + grid + stated + "\n");
    const Outcome outcome =
        run_line((program("") / ("drape-detect " + at("recording").string() + " --rig " +
                                 at("rig.toml").string() + " --surface target --out " +
                                 at("detections.json").string()))
                     .string());
    EXPECT_EQ(outcome.exit_code, 1) << outcome.text;
    EXPECT_NE(outcome.text.find(std::string("tags.border_modules = ") + printed), std::string::npos)
        << outcome.text;
    fs::remove_all(at("pictures"));
    fs::remove_all(at("recording"));
  }
}

TEST_F(Boards, ADotGridWithoutTagsIsFoundAndCalibrates) {
  expect_found_and_calibrated(
      "kind = \"dot-grid\"\nrows = 7\ncols = 10\npitch_mm = 24\ndot_diameter_mm = 10\n", 0.25);
}

// VIC-3D's calibration, very likely of this rig, which comes with the pictures of the DIC
// challenge.
TEST_F(Boards, ARealPlateOfImageCorrelationGivesTheValuesOfAnotherProgram) {
  const auto pictures = reference_data("dic-dots/real");
  if (!pictures) GTEST_SKIP() << "missing: dic-dots of the reference data";
  fs::create_directories(at("pictures"));
  for (const char* number : {"1", "2", "3", "4", "5", "6"})
    for (const auto& [side, camera] : {std::pair("_0", "left"), std::pair("_1", "right")})
      fs::copy_file(*pictures / (std::string("CalB-sys2-000") + number + side + ".jpeg"),
                    at("pictures") / (std::string(camera) + number + ".jpg"));
  write_durable(at("target.toml"),
                "schema = \"drapebench/target/1\"\nkind = \"dot-grid\"\nrows = 30\ncols = 30\n"
                "pitch_mm = 3.5\ndot_diameter_mm = 1.4\n"
                "hollow = [[12, 12], [12, 17], [15, 12]]\nhollow_diameter_mm = 0.5\n");
  run("drape calib images " + at("pictures").string() + " --target " + at("target.toml").string() +
      " --out " + at("out").string());
  const Calibration found = read_calibration(at("out") / "calibration.json");
  EXPECT_FALSE(found.no_go.has_value());
  ASSERT_EQ(found.cameras.size(), 2U);
  const double theirs[2][4] = {{12577, 12577, 1202.5, 1056.0}, {12584, 12584, 1218.0, 1007.7}};
  for (std::size_t c = 0; c < 2; ++c) {
    const auto& lens = std::get<BrownLens>(found.cameras[c].camera.model.lens);
    const double ours[] = {lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px};
    for (int i = 0; i < 4; ++i) {
      const double sd = std::sqrt(found.cameras[c].covariance(i, i));
      EXPECT_NEAR(ours[i], theirs[c][i], 1.96 * sd) << c << ", " << i;
    }
  }
  const CamFromWorld &left = found.cameras[0].camera.cam_from_world,
                     &right = found.cameras[1].camera.cam_from_world;
  EXPECT_NEAR(
      (centre_in_world(found.cameras[0].camera) - centre_in_world(found.cameras[1].camera)).norm() /
          mm,
      89.64, 0.01 * 89.64);
  EXPECT_NEAR(
      Eigen::AngleAxisd(Eigen::Matrix3d(right.rotation * left.rotation.transpose())).angle() / deg,
      27.62, 1);
}

}  // namespace
}  // namespace drape::test

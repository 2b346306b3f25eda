// SPDX-License-Identifier: Apache-2.0
#include "calib/calib.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <limits>

#include "calib/test_targets.hpp"
#include "core/error.hpp"
#include "core/fields/records.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using test::bench1_rig;
using test::bench1_target;
using test::bench1_target_detections;
using testing::HasSubstr;
using units::mm;

/// Text of the Error, or "" when nothing is thrown.
std::string refusal(const Detections& detections, const Rig& rig = bench1_rig()) {
  try {
    static_cast<void>(calibrate_tsai(detections, rig, bench1_target(), {}));
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    return error.what();
  }
  return "";
}

TEST(Calib, FindsBench1sCamerasFromTheFourStages) {
  const CalibResult result =
      calibrate_tsai(bench1_target_detections(0.01), bench1_rig(), bench1_target(), {});
  EXPECT_TRUE(result.report.good());
  ASSERT_EQ(result.calibration.cameras.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const CalibratedCamera& camera = result.calibration.cameras[i];
    const Eigen::Vector3d off =
        centre_in_world(camera.camera) - centre_in_world(test::bench1_truth().cameras[i]);
    EXPECT_LT(off.norm() / mm, 0.05) << camera.camera.name;
    // 0.01 px noise in x and y; the misfit of Tsai's single coefficient can add a third.
    EXPECT_LT(camera.residuals.rms_px, 0.01 * std::sqrt(2.0) * 1.33);
    EXPECT_EQ(camera.residuals.points, 432);
    EXPECT_EQ(camera.covariance.rows(), 11);
    EXPECT_LT(result.report.cameras[i].full.rms_px, result.report.cameras[i].basic.rms_px);
  }
}

TEST(Calib, EccentricityOfTheDotsIsABiasThatTheCorrectionRemoves) {
  const Detections detections = bench1_target_detections(0);
  CalibOptions without;
  without.correct_eccentricity = false;
  const CalibResult corrected = calibrate_tsai(detections, bench1_rig(), bench1_target(), {});
  const CalibResult plain = calibrate_tsai(detections, bench1_rig(), bench1_target(), without);
  const auto mean_error_mm = [](const CalibResult& result) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      sum += (centre_in_world(result.calibration.cameras[i].camera) -
              centre_in_world(test::bench1_truth().cameras[i]))
                 .norm() /
             mm / 3;
    return sum;
  };
  EXPECT_LT(mean_error_mm(corrected), mean_error_mm(plain) / 2);
  EXPECT_GT(corrected.report.cameras[0].max_eccentricity_px, 0.03);
  EXPECT_LT(corrected.report.cameras[0].max_eccentricity_px, 0.1);
}

/// Detections by an invented Tsai camera that sees the dots of four stages as points.
Detections exact_detections(const Camera& camera) {
  Detections detections = bench1_target_detections(0);
  std::erase_if(detections.frames, [](const FrameDetections& f) { return f.camera != "cam0"; });
  const Rig rig = bench1_rig();
  for (const TargetStage& stage : rig.stages) {
    for (FrameDetections& frame : detections.frames) {
      if (frame.set != stage.set) continue;
      for (Detection& d : frame.detections) {
        const Eigen::Vector3d point =
            bench1_target().point_in_target(d.mark) + Eigen::Vector3d(0, 0, stage.z_m);
        d.centre_px = project(camera.model, camera.cam_from_world * point)->px;
      }
    }
  }
  return detections;
}

Camera tsai_camera() {
  Camera camera = test::bench1_truth().cameras[0];
  camera.model.lens = TsaiLens{10.6 * mm, 1200, 812, 589, 1.0005, 3.45e-6, 3.45e-6};
  return camera;
}

Rig one_camera_rig() {
  Rig rig = bench1_rig();
  rig.cameras.resize(1);
  return rig;
}

CalibOptions point_targets() {
  CalibOptions options;
  options.correct_eccentricity = false;
  return options;
}

TEST(Calib, RecoversAnExactTsaiCamera) {
  const Camera truth = tsai_camera();
  const CalibResult result =
      calibrate_tsai(exact_detections(truth), one_camera_rig(), bench1_target(), point_targets());
  ASSERT_TRUE(result.report.good());
  const Camera& found = result.calibration.cameras[0].camera;
  const auto& lens = std::get<TsaiLens>(found.model.lens);
  EXPECT_NEAR(lens.focal_m / mm, 10.6, 1e-7);
  EXPECT_NEAR(lens.kappa1_per_m2, 1200, 1e-4);
  EXPECT_NEAR(lens.cx_px, 812, 1e-6);
  EXPECT_NEAR(lens.cy_px, 589, 1e-6);
  EXPECT_NEAR(lens.scale_x, 1.0005, 1e-9);
  EXPECT_LT((centre_in_world(found) - centre_in_world(truth)).norm(), 1e-9);
  EXPECT_LT(result.calibration.cameras[0].residuals.rms_px, 1e-8);
}

TEST(Calib, ShiftsTheOriginWhenTyIsNearZero) {
  Camera truth = tsai_camera();
  for (const double ty_mm : {0.0, 0.001, -0.5}) {
    truth.cam_from_world.translation_m.y() = ty_mm * mm;
    const CalibResult result =
        calibrate_tsai(exact_detections(truth), one_camera_rig(), bench1_target(), point_targets());
    ASSERT_TRUE(result.report.good()) << result.report.cameras[0].status;
    EXPECT_TRUE(result.report.cameras[0].origin_shifted);
    EXPECT_LT(
        (centre_in_world(result.calibration.cameras[0].camera) - centre_in_world(truth)).norm(),
        1e-9);
  }
}

TEST(Calib, CovariancePredictsTheScatterOfRepeatedCalibrations) {
  constexpr int kRuns = 60;
  const Camera truth = tsai_camera();
  const Detections exact = exact_detections(truth);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.05);
  double sum_focal2 = 0, sum_tz2 = 0, predicted_focal2 = 0, predicted_tz2 = 0;
  for (int run = 0; run < kRuns; ++run) {
    Detections noisy = exact;
    for (FrameDetections& frame : noisy.frames) {
      for (Detection& d : frame.detections) {
        d.centre_px += Eigen::Vector2d(noise(random), noise(random));
        d.covariance_px2 = 0.05 * 0.05 * Eigen::Matrix2d::Identity();
      }
    }
    const CalibResult result =
        calibrate_tsai(noisy, one_camera_rig(), bench1_target(), point_targets());
    const CalibratedCamera& found = result.calibration.cameras[0];
    const double focal = std::get<TsaiLens>(found.camera.model.lens).focal_m / mm - 10.6;
    const double tz =
        (found.camera.cam_from_world.translation_m.z() - truth.cam_from_world.translation_m.z()) /
        mm;
    sum_focal2 += focal * focal / kRuns;
    sum_tz2 += tz * tz / kRuns;
    predicted_focal2 += found.covariance(0, 0) / kRuns;
    predicted_tz2 += found.covariance(10, 10) / kRuns;
  }
  // A variance of 60 draws has a relative standard deviation of sqrt(2/60) = 0.18; four of these.
  EXPECT_NEAR(sum_focal2 / predicted_focal2, 1, 0.73);
  EXPECT_NEAR(sum_tz2 / predicted_tz2, 1, 0.73);
}

TEST(Calib, RejectsAMislabelledDotByName) {
  Detections detections = bench1_target_detections(0.01);
  for (FrameDetections& frame : detections.frames) {
    if (frame.set == "stage_z060" && frame.camera == "cam1")
      frame.detections[40].centre_px += Eigen::Vector2d(3, -2);
  }
  const CalibResult result = calibrate_tsai(detections, bench1_rig(), bench1_target(), {});
  EXPECT_TRUE(result.report.good());
  ASSERT_EQ(result.report.cameras[1].rejected.size(), 1u);
  EXPECT_THAT(result.report.cameras[1].rejected[0], HasSubstr("set stage_z060, dot (3, 4)"));
  EXPECT_THAT(result.calibration.warnings[0], HasSubstr("cam1: rejected"));
}

/// One dot in twenty off by 0.05 px, then by 0.3 px, among dots that fit to 0.001 px: harmless at
/// the target, then rejected but far below the limit in mm. By 3 px they are gross.
TEST(Calib, JudgesRejectedDotsByTheirErrorAtTheTarget) {
  struct Case {
    double off_px;
    bool rejected, good;
  };
  for (const auto& [off_px, rejected, good] :
       {Case{0.05, false, true}, Case{0.3, true, true}, Case{3, true, false}}) {
    Detections detections = bench1_target_detections(0.001);
    for (FrameDetections& frame : detections.frames)
      for (std::size_t i = 7; i < frame.detections.size(); i += 20)
        frame.detections[i].centre_px.x() += i % 40 < 20 ? off_px : -off_px;
    const CalibResult result = calibrate_tsai(detections, bench1_rig(), bench1_target(), {});
    EXPECT_EQ(result.report.good(), good) << off_px << result.report.cameras[0].status;
    EXPECT_EQ(!result.report.cameras[0].rejected.empty(), rejected) << off_px;
  }
}

TEST(Calib, IsNoGoWhenTheHeightsAreWrong) {
  Rig rig = bench1_rig();
  rig.stages[2].z_m = 0.065;
  const CalibResult result =
      calibrate_tsai(bench1_target_detections(0.01), rig, bench1_target(), {});
  EXPECT_FALSE(result.report.good());
  EXPECT_THAT(result.report.cameras[0].status, HasSubstr("RMS"));
  EXPECT_FALSE(result.calibration.warnings.empty());
}

TEST(Calib, IsNoGoWhenTheParametersAreHardlyDetermined) {
  // A small distant part of the target at two close heights, with coarse marks.
  Rig rig = bench1_rig();
  rig.stages.resize(2);
  Detections detections = bench1_target_detections(0.3);
  for (FrameDetections& frame : detections.frames) {
    std::erase_if(frame.detections,
                  [](const Detection& d) { return d.mark.row > 2 || d.mark.col > 2; });
  }
  CalibOptions options;
  options.max_rms_mm = 10;
  const CalibResult result = calibrate_tsai(detections, rig, bench1_target(), options);
  EXPECT_FALSE(result.report.good());
  EXPECT_THAT(result.report.cameras[0].status,
              testing::AnyOf(HasSubstr("ill-conditioned"), HasSubstr("not converged")));
}

TEST(Calib, RefusesHeightsThatHardlyDiffer) {
  Rig rig = bench1_rig();
  for (std::size_t i = 0; i < rig.stages.size(); ++i)
    rig.stages[i].z_m = 1e-6 * static_cast<double>(i);
  EXPECT_THAT(refusal(bench1_target_detections(0), rig), HasSubstr("no depth"));
}

TEST(Calib, RefusesARigOfFreePosesAloneAndNamesTheMethodForIt) {
  Rig rig = bench1_rig();
  rig.stages.clear();
  EXPECT_THAT(refusal(bench1_target_detections(0), rig), HasSubstr("--method joint"));
}

TEST(Calib, RefusesTooFewPoints) {
  Detections detections = bench1_target_detections(0);
  for (FrameDetections& frame : detections.frames) frame.detections.resize(2);
  const std::string said = refusal(detections);
  EXPECT_THAT(said, HasSubstr("8 target points"));
  EXPECT_THAT(said, HasSubstr("cam0"));
}

TEST(Calib, RefusesMirroredData) {
  Rig rig = bench1_rig();
  for (TargetStage& stage : rig.stages) stage.z_m = -stage.z_m;
  EXPECT_THAT(refusal(bench1_target_detections(0), rig), HasSubstr("mirrored"));
}

TEST(Calib, RefusesNumbersThatAreNotFinite) {
  Detections detections = bench1_target_detections(0);
  for (FrameDetections& frame : detections.frames) {
    if (frame.set == "stage_z030" && frame.camera == "cam2")
      frame.detections[5].centre_px.x() = std::numeric_limits<double>::quiet_NaN();
  }
  const std::string said = refusal(detections);
  EXPECT_THAT(said, HasSubstr("cam2"));
  EXPECT_THAT(said, HasSubstr("stage_z030"));
  EXPECT_THAT(said, HasSubstr("(0, 5)"));
}

TEST(Calib, RefusesAMissingFrameByName) {
  Detections detections = bench1_target_detections(0);
  std::erase_if(detections.frames, [](const FrameDetections& frame) {
    return frame.set == "stage_z090" && frame.camera == "cam1";
  });
  const std::string said = refusal(detections);
  EXPECT_THAT(said, HasSubstr("stage_z090"));
  EXPECT_THAT(said, HasSubstr("cam1"));
}

TEST(Calib, RefusesDetectionsOfAnotherTargetOrSize) {
  Detections other = bench1_target_detections(0);
  other.lattice.pitch_m = 0.025;
  EXPECT_THAT(refusal(other), HasSubstr("another target"));
  Detections small = bench1_target_detections(0);
  for (FrameDetections& frame : small.frames) frame.width_px = 640;
  EXPECT_THAT(refusal(small), HasSubstr("640 x 1200"));
  Detections cloth = bench1_target_detections(0);
  cloth.lattice.surface = Surface::cloth;
  EXPECT_THAT(refusal(cloth), HasSubstr("of a cloth"));
}

TEST(CalibOptions, RefuseWhatMakesNoSense) {
  CalibOptions options;
  options.max_rms_mm = 0;
  EXPECT_THROW(check_record(options), Error);
  options = {};
  options.max_outliers_percent = -1;
  EXPECT_THROW(check_record(options), Error);
}

}  // namespace
}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
// A z stage that deviates from rig.toml, and a rig with a single stage.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "calib/test_targets.hpp"
#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"

namespace drape::calib {
namespace {

using test::bench1_rig;
using test::bench1_target;
using test::bench1_target_detections;
using test::SyntheticBench;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using units::deg;
using units::mm;

/// Views of a bench whose upper stage deviates from its stated position and orientation.
JointModel views_of_a_bad_stage(const WorldFromTarget& truth, bool believed) {
  const SyntheticBench bench(4);
  JointModel model = bench.true_model();
  const WorldFromTarget said = model.placements[1].world_from_target;
  model.placements[1].world_from_target = truth;
  test::see(model, 0.05, 77);
  JointModel views = test::forgotten(model);
  views.placements[1].world_from_target = said;
  views.placements[1].known = believed;
  start_joint(views);
  return views;
}

JointResult calibrated(const JointModel& views) {
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  return calibrate_joint(views, 0, options);
}

WorldFromTarget raised(double x_m, double y_m, double z_m) {
  WorldFromTarget pose;
  pose.translation_m = {x_m, y_m, z_m};
  return pose;
}

constexpr double kStroke_m = 0.06;

TEST(StageCheck, MeasuresTheTiltOfTheAxisAndSaysSo) {
  const double tilt_rad = 0.5 * deg;
  const JointResult result =
      calibrated(views_of_a_bad_stage(raised(tilt_rad * kStroke_m, 0, kStroke_m), true));
  ASSERT_TRUE(result.report.stages);
  const StageCheck& check = *result.report.stages;
  EXPECT_NEAR(check.tilt_deg.x(), 0.5, 0.03 + 4 * check.tilt_sd_deg.x());
  EXPECT_LT(check.tilt_sd_deg.maxCoeff(), 0.05);
  EXPECT_THAT(result.calibration.warnings, Contains(HasSubstr("z stage: its axis tilts by +0.5")));
  EXPECT_THAT(result.calibration.warnings, Contains(HasSubstr("--free-stages")));
}

TEST(StageCheck, TellsAWrongStrokeAndSaysSo) {
  const JointResult result = calibrated(views_of_a_bad_stage(raised(0, 0, 1.01 * kStroke_m), true));
  ASSERT_TRUE(result.report.stages);
  const StageCheck& check = *result.report.stages;
  EXPECT_NEAR(check.stroke_percent, 1, 0.05 + 4 * check.stroke_sd_percent);
  EXPECT_THAT(result.calibration.warnings, Contains(HasSubstr("z stage: its stroke differs by +")));
}

TEST(StageCheck, MeasuresATargetThatTipsAsItRises) {
  WorldFromTarget tipped = raised(0, 0, kStroke_m);
  tipped.rotation = rotation_about(0.3 * deg * Eigen::Vector3d::UnitY());
  const JointResult result = calibrated(views_of_a_bad_stage(tipped, true));
  ASSERT_TRUE(result.report.stages);
  EXPECT_NEAR(result.report.stages->turn_deg.y(), 0.3,
              0.03 + 4 * result.report.stages->turn_sd_deg.y());
  EXPECT_THAT(result.calibration.warnings, Contains(HasSubstr("z stage: the target turns by")));
}

// A gross error in height drops the stage from the initial values; nothing later reveals it.
TEST(StageCheck, AStageThatTheStartDroppedIsNoGo) {
  Rig rig = bench1_rig();
  for (int i = 0; i < 15; ++i)
    rig.free_poses.push_back("pose_" + std::string(i < 10 ? "0" : "") + std::to_string(i));
  const Detections detections = bench1_target_detections(0.01);
  for (const double times : {4.0, 10.0}) {
    Rig wrong = rig;
    wrong.stages[3].z_m *= times;
    const JointResult one = calibrate_joint(detections, wrong, bench1_target(), {});
    EXPECT_FALSE(one.report.good()) << times;
    EXPECT_THAT(one.report.status, HasSubstr("z_mm = " + std::to_string(int(90 * times)))) << times;
    for (std::size_t k = 1; k < 3; ++k) wrong.stages[k].z_m *= times;
    const JointResult all = calibrate_joint(detections, wrong, bench1_target(), {});
    EXPECT_FALSE(all.report.good()) << times;
    EXPECT_THAT(all.report.status, HasSubstr("z stage:")) << times;
  }
}

TEST(StageCheck, HeightsInCentimetresAreNamedAsSuch) {
  Rig rig = bench1_rig();
  for (int i = 0; i < 15; ++i)
    rig.free_poses.push_back("pose_" + std::string(i < 10 ? "0" : "") + std::to_string(i));
  for (TargetStage& stage : rig.stages) stage.z_m /= 10;
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  std::string said;
  try {
    said = calibrate_joint(bench1_target_detections(0.01), rig, bench1_target(), options)
               .report.status;
  } catch (const Error& error) {
    said = error.what();
  }
  EXPECT_THAT(said, HasSubstr("strokes contradict each other"));
}

TEST(StageCheck, AFreeStageDoesNoHarm) {
  const WorldFromTarget bad = raised(0.5 * deg * kStroke_m, 0, 1.01 * kStroke_m);
  const JointModel truth = SyntheticBench(4).true_model();
  const auto worst_mm = [&](const JointResult& result) {
    double worst = 0;
    for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
      worst = std::max(worst, (centre_in_world(result.calibration.cameras[c].camera) -
                               centre_in_world(truth.cameras[c].camera))
                                      .norm() /
                                  mm);
    }
    return worst;
  };
  const JointResult believed = calibrated(views_of_a_bad_stage(bad, true));
  const JointResult free = calibrated(views_of_a_bad_stage(bad, false));
  EXPECT_FALSE(free.report.stages);
  for (const JointCameraReport& camera : free.report.cameras)
    EXPECT_LT(worst_mm(free), 4 * camera.position_sd_mm);
  EXPECT_GT(worst_mm(believed), worst_mm(free));
}

TEST(StageCheck, FreeStagesIsAnOptionOfTheWholeCalibration) {
  Rig rig = bench1_rig();
  for (int i = 0; i < 15; ++i)
    rig.free_poses.push_back("pose_" + std::string(i < 10 ? "0" : "") + std::to_string(i));
  rig.stages[3].z_m = 0.0903;
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  const Detections detections = bench1_target_detections(0.01);
  const JointResult believed = calibrate_joint(detections, rig, bench1_target(), options);
  EXPECT_THAT(believed.calibration.warnings, Contains(HasSubstr("z stage:")));
  options.free_stages = true;
  const JointResult free = calibrate_joint(detections, rig, bench1_target(), options);
  EXPECT_TRUE(free.report.good());
  EXPECT_THAT(free.calibration.warnings, ElementsAre(HasSubstr("nothing checks the scale")));
  EXPECT_EQ(free.calibration.sets.size(), 19U);
}

TEST(StageCheck, SaysNothingOfBench1sStages) {
  for (const CameraReport& camera :
       calibrate_tsai(bench1_target_detections(0.01), bench1_rig(), bench1_target(), {})
           .report.cameras) {
    ASSERT_TRUE(camera.stages) << camera.camera;
    EXPECT_TRUE(camera.stages->findings.empty()) << camera.stages->findings.front();
  }
}

TEST(StageCheck, TsaisMethodTellsAWrongStrokeByItself) {
  Rig rig = bench1_rig();
  for (TargetStage& stage : rig.stages) stage.z_m /= 1.002;
  const CalibResult result =
      calibrate_tsai(bench1_target_detections(0.01), rig, bench1_target(), {});
  for (const CameraReport& camera : result.report.cameras) {
    ASSERT_TRUE(camera.stages);
    EXPECT_NEAR(camera.stages->stroke_percent, 0.2, 0.02 + 4 * camera.stages->stroke_sd_percent);
    EXPECT_THAT(camera.stages->findings, Contains(HasSubstr("z stage: its stroke differs by +0.")));
  }
  EXPECT_THAT(result.calibration.warnings,
              Contains(HasSubstr("cam0: z stage: its stroke differs by +0.")));
}

TEST(StageCheck, TsaisMethodNamesTheFactorOfAStrokeThatIsFarOff) {
  for (const double times : {0.7, 0.9, 1.1, 1.3}) {
    Rig rig = bench1_rig();
    for (TargetStage& stage : rig.stages) stage.z_m *= times;
    for (const CameraReport& camera :
         calibrate_tsai(bench1_target_detections(0.01), rig, bench1_target(), {}).report.cameras) {
      ASSERT_TRUE(camera.stages) << times;
      EXPECT_NEAR(camera.stages->stroke_percent, 100 * (1 / times - 1),
                  0.02 / times + 4 * camera.stages->stroke_sd_percent)
          << camera.camera;
      EXPECT_THAT(camera.status, HasSubstr("contradict each other by"));
      EXPECT_THAT(camera.status, HasSubstr("would agree"));
    }
  }
}

/// bench1 with its first stage only.
Rig one_stage() {
  Rig rig = bench1_rig();
  rig.stages.resize(1);
  return rig;
}

TEST(OnePlane, CalibratesWhereTheViewDeterminesTheCamera) {
  const CalibResult result =
      calibrate_tsai(bench1_target_detections(0.01), one_stage(), bench1_target(), {});
  ASSERT_EQ(result.calibration.cameras.size(), 3U);
  for (int i = 0; i < 3; ++i) {
    const CameraReport& report = result.report.cameras[i];
    EXPECT_EQ(report.planes, 1);
    EXPECT_TRUE(report.good()) << report.status;
    EXPECT_THAT(report.notes, Contains(HasSubstr("one view of one plane")));
    // bench1's rig.toml asks for s_x, which one plane cannot determine.
    EXPECT_THAT(report.notes, Contains(HasSubstr("s_x kept at 1")));
    const CalibratedCamera& camera = result.calibration.cameras[i];
    const double off_mm =
        (centre_in_world(camera.camera) - centre_in_world(test::bench1_truth().cameras[i])).norm() /
        mm;
    std::printf(
        "one plane, %s: f +- %.3f mm, image centre +- %.2f px, camera centre off by %.2f mm\n",
        report.camera.c_str(), report.focal_sd_mm, report.centre_sd_px, off_mm);
    EXPECT_LT(off_mm, 5);
  }
}

TEST(OnePlane, RaisedByItsStageIsTheSameCameraHigherUp) {
  Rig raised = one_stage();
  raised.stages[0].z_m = 0.1;
  const Detections detections = bench1_target_detections(0.01);
  const CalibResult flat = calibrate_tsai(detections, one_stage(), bench1_target(), {});
  const CalibResult high = calibrate_tsai(detections, raised, bench1_target(), {});
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d up = centre_in_world(high.calibration.cameras[i].camera) -
                               centre_in_world(flat.calibration.cameras[i].camera);
    EXPECT_LT((up - Eigen::Vector3d(0, 0, 0.1)).norm(), 1e-6) << i;
  }
}

TEST(OnePlane, IsNoGoWithTheReasonWhereNoiseLeavesTheCameraOpen) {
  Detections detections = bench1_target_detections(0.3);
  CalibOptions options;
  options.max_rms_mm = 10;
  const CalibResult result = calibrate_tsai(detections, one_stage(), bench1_target(), options);
  EXPECT_FALSE(result.report.good());
  EXPECT_THAT(result.report.cameras[0].status,
              testing::AnyOf(HasSubstr("image centre known to"), HasSubstr("focal length known to"),
                             HasSubstr("not converged")));
}

TEST(OnePlane, ParallelToTheImageIsRefusedByName) {
  Detections detections = bench1_target_detections(0);
  for (FrameDetections& frame : detections.frames) {
    const double middle = 800.0 + (frame.camera.back() - '0');  // no two pictures are identical
    for (Detection& d : frame.detections)
      d.centre_px = {middle + 90 * (d.mark.col - 5.5), 600.0 - 90 * (d.mark.row - 4.0)};
  }
  try {
    static_cast<void>(calibrate_tsai(detections, one_stage(), bench1_target(), {}));
    FAIL() << "a plane parallel to the image was taken";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_THAT(error.what(),
                testing::AnyOf(HasSubstr("too little tilt"), HasSubstr("cannot be separated")));
    EXPECT_THAT(error.what(), HasSubstr("cam0"));
  }
}

}  // namespace
}  // namespace drape::calib

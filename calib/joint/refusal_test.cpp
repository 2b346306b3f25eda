// SPDX-License-Identifier: Apache-2.0
// Every set of views that cannot calibrate is refused or flagged, with reason and next action.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "calib/test_targets.hpp"
#include "core/error.hpp"
#include "core/geometry/vectors.hpp"

namespace drape::calib {
namespace {

using test::forgotten;
using test::see;
using test::SyntheticBench;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;
using units::deg;

/// Text of the Error with its advice, or "" if nothing is refused.
std::string refusal(const JointModel& seen) {
  try {
    JointModel model = forgotten(seen);
    check_places(model);
    start_joint(model);
    const JointResult result = calibrate_joint(model, 0, {});
    return result.report.good() ? "" : result.report.status;
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::bad_input);
    EXPECT_FALSE(error.what_to_do().empty());
    return error.what();
  }
}

/// One camera of the invented bench and its free poses, the first of which defines the world.
JointModel one_camera(int poses = 6) {
  JointModel model = SyntheticBench(5).true_model();
  model.cameras.resize(1);
  model.placements.erase(model.placements.begin(), model.placements.begin() + 2);
  model.placements.resize(poses);
  model.placements.front().known = true;
  model.placements.front().world_from_target = {};
  see(model, 0.05, 7);
  return model;
}

TEST(JointRefusals, GoodViewsAreNotRefused) {
  for (unsigned seed = 0; seed < 5; ++seed)
    EXPECT_EQ(refusal(SyntheticBench(seed).true_model()), "") << seed;
  EXPECT_EQ(refusal(one_camera()), "");
}

TEST(JointRefusals, ParallelPlanesAreRefused) {
  JointModel model = one_camera();
  for (Placement& placement : model.placements) {
    placement.world_from_target.rotation.setIdentity();
    placement.world_from_target.translation_m.z() += 0.01;
  }
  model.placements.front().world_from_target = {};
  see(model, 0.05, 7);
  EXPECT_THAT(refusal(model), AllOf(HasSubstr("parallel planes"), HasSubstr("another axis")));
}

TEST(JointRefusals, TooLittleTiltIsRefused) {
  JointModel model = one_camera();
  // Directly above, with the target rotated only about the optical axis.
  model.cameras[0].camera.cam_from_world.rotation = Eigen::Vector3d(1, -1, -1).asDiagonal();
  model.cameras[0].camera.cam_from_world.translation_m = {0, 0, 0.8};
  double turn = 0;
  for (Placement& placement : model.placements) {
    placement.world_from_target.rotation = rotation_about((turn += 0.3) * Eigen::Vector3d::UnitZ());
  }
  model.placements.front().world_from_target = {};
  see(model, 0.05, 7);
  EXPECT_THAT(refusal(model),
              AllOf(AnyOf(HasSubstr("too little tilt"), HasSubstr("parallel to the image")),
                    HasSubstr("30 degrees")));
}

TEST(JointRefusals, OneShotWithFreeCentreIsRefused) {
  EXPECT_THAT(refusal(one_camera(1)), AllOf(HasSubstr("one view"), HasSubstr("not observable")));
}

TEST(JointRefusals, LeftHandedPointsAreRefused) {
  JointModel model = one_camera();
  for (JointFrame& frame : model.frames) {
    for (TargetPoint& point : frame.points) point.measured_px.x() = 1599 - point.measured_px.x();
  }
  EXPECT_THAT(refusal(model), HasSubstr("left-handed"));
}

TEST(JointRefusals, AViewWithSwappedCornerOrderIsLeftOut) {
  JointModel model = SyntheticBench(5).true_model();
  JointFrame& frame = model.frames[10];
  const JointFrame straight = frame;
  for (std::size_t i = 0; i < frame.points.size(); ++i)
    frame.points[i].measured_px = straight.points[frame.points.size() - 1 - i].measured_px;
  const std::string camera = model.cameras[frame.camera].camera.name;
  const std::string set = model.placements[frame.placement].set;
  EXPECT_EQ(refusal(model), "");
  JointModel started = forgotten(model);
  EXPECT_THAT(start_joint(started), testing::ElementsAre(AllOf(HasSubstr("corner order"),
                                                               HasSubstr(set), HasSubstr(camera))));
  EXPECT_EQ(started.frames.size() + 1, model.frames.size());
}

TEST(JointRefusals, ViewsInOneCornerOfTheImageAreRefused) {
  JointModel model = one_camera();
  model.cameras[0].camera.model.width_px = 4000;
  model.cameras[0].camera.model.height_px = 3000;
  EXPECT_THAT(refusal(model), HasSubstr("one corner of the image"));
}

TEST(JointRefusals, ACameraWithoutACommonViewIsRefused) {
  JointModel model = SyntheticBench(5).true_model();
  std::erase_if(model.frames, [](const JointFrame& frame) {
    return (frame.camera == 2) == (frame.placement < 6);
  });
  EXPECT_THAT(refusal(model), AllOf(HasSubstr("has no view"), HasSubstr("cam2")));
}

TEST(JointRefusals, DuplicateViewsAreNamed) {
  JointModel model = SyntheticBench(5).true_model();
  model.placements[5].world_from_target = model.placements[4].world_from_target;
  see(model, 0.05, 7);
  model = forgotten(model);
  start_joint(model);
  const JointResult result = calibrate_joint(model, 0, {});
  EXPECT_THAT(result.calibration.warnings,
              testing::Contains(
                  AllOf(HasSubstr("duplicate views"), HasSubstr("pose2"), HasSubstr("pose3"))));
}

TEST(JointRefusals, ASetOrAPictureGivenTwiceIsRefused) {
  const auto refusal_of = [](const Detections& detections, const Rig& rig, bool joint) {
    try {
      if (joint)
        static_cast<void>(calibrate_joint(detections, rig, test::bench1_target(), {}));
      else
        static_cast<void>(calibrate_tsai(detections, rig, test::bench1_target(), {}));
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Detections good = test::bench1_target_detections(0.01);
  for (const bool joint : {false, true}) {
    Rig rig = test::bench1_rig();
    rig.stages.push_back(rig.stages[1]);
    EXPECT_THAT(refusal_of(good, rig, joint), AllOf(HasSubstr("twice"), HasSubstr("stage_z030")));
    rig = test::bench1_rig();
    rig.free_poses = {"stage_z060"};
    EXPECT_THAT(refusal_of(good, rig, joint),
                AllOf(HasSubstr("calibration.free_poses"), HasSubstr("stage_z060")));
    Detections copied = good;
    const auto view_of = [&](const std::string& set) {
      return std::find_if(
          copied.frames.begin(), copied.frames.end(),
          [&](const FrameDetections& f) { return f.set == set && f.camera == "cam1"; });
    };
    view_of("stage_z090")->detections = view_of("stage_z030")->detections;
    EXPECT_THAT(refusal_of(copied, test::bench1_rig(), joint),
                AllOf(HasSubstr("this picture is also the one of set stage_z030, cam1"),
                      HasSubstr("stage_z090")));
    view_of("stage_z090")->set = "not used";
    EXPECT_THAT(refusal_of(copied, test::bench1_rig(), joint), Not(HasSubstr("this picture")));
  }
}

TEST(JointRefusals, NumbersThatAreNotFiniteAreRefused) {
  Detections detections = test::bench1_target_detections(0.01);
  detections.frames[4].detections[5].centre_px.x() = std::numeric_limits<double>::quiet_NaN();
  try {
    static_cast<void>(calibrate_joint(detections, test::bench1_rig(), test::bench1_target(), {}));
    ADD_FAILURE() << "accepted";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(detections.frames[4].set), HasSubstr("(0, 5)")));
  }
}

TEST(JointRefusals, AWrongTargetSizeIsFoundByTheKnownLength) {
  Target target = test::bench1_target();
  target.known_lengths = {{{0, 0}, {8, 11}, 0.2734, 0.00005}};  // the pitch gives 272.029 mm
  const Detections detections = test::bench1_target_detections(0.01);
  for (const bool joint : {false, true}) {
    try {
      if (joint) {
        static_cast<void>(calibrate_joint(detections, test::bench1_rig(), target, {}));
      } else {
        static_cast<void>(calibrate_tsai(detections, test::bench1_rig(), target, {}));
      }
      ADD_FAILURE() << "accepted";
    } catch (const Error& error) {
      EXPECT_THAT(error.what(),
                  AllOf(HasSubstr("wrong target size"), HasSubstr("pitch_mm = 20.1")));
    }
  }
}

TEST(JointRefusals, AKnownLengthThatAgreesMakesTheScalesUncertaintyKnown) {
  Rig rig = test::bench1_rig();
  Target target = test::bench1_target();
  const Detections detections = test::bench1_target_detections(0.01);
  const JointResult without = calibrate_joint(detections, rig, target, {});
  target.known_lengths = {{{0, 0}, {8, 11}, 0.27205, 0.00005}};
  const JointResult with = calibrate_joint(detections, rig, target, {});
  EXPECT_EQ(with.report.status, "good");
  // The camera is about 0.78 m from the origin: 0.05 mm in 272 mm is 0.14 mm there.
  const double centre_mm = centre_in_world(with.calibration.cameras[0].camera).norm() * 1000;
  const double scale = 0.05 / 272.05;
  EXPECT_NEAR(
      std::pow(with.report.cameras[0].position_sd_mm, 2),
      std::pow(without.report.cameras[0].position_sd_mm, 2) + std::pow(scale * centre_mm, 2), 1e-6);
}

TEST(JointRefusals, AWrongPitchContradictsTheStagesHeights) {
  JointModel model = SyntheticBench(5).true_model();
  for (JointFrame& frame : model.frames) {
    for (TargetPoint& point : frame.points) point.point_in_target *= 1.02;
  }
  EXPECT_THAT(refusal(model), HasSubstr("pitch and the z stage's strokes contradict each other"));
}

}  // namespace
}  // namespace drape::calib

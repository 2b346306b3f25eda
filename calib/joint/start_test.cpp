// SPDX-License-Identifier: Apache-2.0
// Initial values are found where possible: one bad view, few points, chained cameras, a transparent
// target, known lenses.
#include "calib/joint/start.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "calib/joint.hpp"
#include "calib/test_real_boards.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using namespace calib;
using test::forgotten;
using test::real_board;
using test::RealBoard;
using test::see;
using test::SyntheticBench;
using test::trial_count;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using units::mm;

double largest_centre_error_mm(const JointModel& found, const JointModel& truth) {
  double largest = 0;
  for (std::size_t c = 0; c < found.cameras.size(); ++c) {
    largest = std::max(largest, (centre_in_world(found.cameras[c].camera) -
                                 centre_in_world(truth.cameras[c].camera))
                                        .norm() /
                                    mm);
  }
  return largest;
}

/// One fiftieth of the cameras' distance of 0.7 m, from which the fit always converges.
constexpr double kNear_mm = 14;

TEST(JointStart, IsNearWithDistortionAlready) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const SyntheticBench bench(seed);
    JointModel model = bench.noisy_views();
    EXPECT_THAT(start_joint(model), IsEmpty());
    EXPECT_LT(largest_centre_error_mm(model, bench.true_model()), kNear_mm) << seed;
  }
}

TEST(JointStart, FourPointsOfAViewAreEnough) {
  const SyntheticBench bench(2);
  JointModel model = bench.noisy_views();
  JointFrame& frame = model.frames[9];
  frame.points = {frame.points[0], frame.points[11], frame.points[96], frame.points[107]};
  EXPECT_THAT(start_joint(model), IsEmpty());
  const JointResult result = calibrate_joint(model, 0, {});
  EXPECT_EQ(result.report.status, "good");
}

TEST(JointStart, CamerasThatNeverSeeTheTargetTogetherAreChained) {
  const SyntheticBench bench(3, 12);
  JointModel model = bench.noisy_views();
  // cam0 and cam2 have no view in common; cam1 sees everything.
  std::erase_if(model.frames, [](const JointFrame& frame) {
    return frame.camera == (frame.placement % 2 == 0 ? 2u : 0u);
  });
  EXPECT_THAT(start_joint(model), IsEmpty());
  EXPECT_LT(largest_centre_error_mm(model, bench.true_model()), kNear_mm);
}

TEST(JointStart, ACameraBehindASeeThroughTargetIsPlaced) {
  JointModel truth = SyntheticBench(4).true_model();
  // The third camera is below the plate and sees the same marks through it.
  CamFromWorld& pose = truth.cameras[2].camera.cam_from_world;
  pose.rotation = Eigen::Matrix3d::Identity();
  pose.rotation = rotation_about(Eigen::Vector3d(0.4, 0.2, 0)) * pose.rotation;
  pose.translation_m = {0, 0, 0.8};
  see(truth, 0.05, 9);
  JointModel model = forgotten(truth);
  EXPECT_THAT(start_joint(model), testing::ElementsAre(HasSubstr("cam2: sees the target from "
                                                                 "behind")));
  EXPECT_LT(largest_centre_error_mm(model, truth), kNear_mm);
}

/// Two cameras face the bench's three; the board is turned towards one side or the other, and its
/// back is `thickness_m` behind its front.
JointModel around_a_two_sided_board(unsigned seed, double thickness_m) {
  JointModel truth = SyntheticBench(seed, 14).true_model();
  const Eigen::Matrix3d half_turn = Eigen::Vector3d(1, -1, -1).asDiagonal();
  truth.placements.erase(truth.placements.begin() + 1);
  for (std::size_t p = 1; p < truth.placements.size(); p += 2)
    truth.placements[p].world_from_target.rotation *= half_turn;
  for (std::size_t c = 0; c < 2; ++c) {
    JointCamera opposite = truth.cameras[c];
    opposite.camera.name = "opposite" + std::to_string(c);
    opposite.camera.cam_from_world.rotation *= half_turn;
    truth.cameras.push_back(opposite);
  }
  // The bench sees flat points; those of views from behind are deeper.
  see(truth, 0.05, seed);
  JointModel deeper = truth;
  for (Placement& placement : deeper.placements)
    placement.world_from_target.translation_m -=
        thickness_m * placement.world_from_target.rotation.col(2);
  see(deeper, 0.05, seed);
  for (std::size_t f = 0; f < truth.frames.size(); ++f) {
    const JointFrame& frame = truth.frames[f];
    const WorldFromTarget& pose = truth.placements[frame.placement].world_from_target;
    const Eigen::Vector3d towards =
        centre_in_world(truth.cameras[frame.camera].camera) - pose.translation_m;
    if (pose.rotation.col(2).dot(towards) < 0) truth.frames[f] = deeper.frames[f];
  }
  return truth;
}

TEST(JointStart, BothSidesOfABoardCalibrateCamerasAllAroundIt) {
  const double thickness_m = 5 * mm;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const JointModel truth = around_a_two_sided_board(seed, thickness_m);
    JointModel model = forgotten(truth);
    StartOptions options;
    options.thickness_m = thickness_m;
    const std::vector<std::string> notes = start_joint(model, options);
    ASSERT_EQ(notes.size(), 5U);
    EXPECT_THAT(notes, testing::Each(HasSubstr("sees the target's back in")));
    const JointResult result = calibrate_joint(model, 0, {});
    EXPECT_EQ(result.report.status, "good") << seed;
    for (std::size_t c = 0; c < truth.cameras.size(); ++c) {
      const double off_mm = (centre_in_world(result.calibration.cameras[c].camera) -
                             centre_in_world(truth.cameras[c].camera))
                                .norm() /
                            mm;
      EXPECT_LT(off_mm, 4 * result.report.cameras[c].position_sd_mm) << seed << " " << c;
    }
  }
}

TEST(JointStart, AMirroredPictureIsStillRefused) {
  const int cases = trial_count(6, 200);
  int named = 0;
  for (int seed = 0; seed < cases; ++seed) {
    JointModel model = SyntheticBench(static_cast<unsigned>(seed)).noisy_views();
    const std::size_t camera = static_cast<std::size_t>(seed) % 3;
    const bool upside_down = seed % 2 == 1;
    for (JointFrame& frame : model.frames) {
      if (frame.camera != camera) continue;
      for (TargetPoint& point : frame.points) {
        if (upside_down)
          point.measured_px.y() = 1199 - point.measured_px.y();
        else
          point.measured_px.x() = 1599 - point.measured_px.x();
      }
    }
    try {
      start_joint(model);
      ADD_FAILURE() << "accepted " << seed;
    } catch (const Error& error) {
      const std::string name = "cam" + std::to_string(camera);
      EXPECT_THAT(error.what(), AllOf(HasSubstr("mirrored"), HasSubstr(name))) << seed;
      named += std::string(error.what()).find("mirrored") != std::string::npos;
    }
  }
  EXPECT_EQ(named, cases);
}

TEST(JointStart, OneBadViewOfARealBoardIsDroppedByName) {
  const RealBoard good = real_board("bouguet");
  // A rotated order of corners, labels one column off, and points at random.
  for (const int fault : {0, 1, 2}) {
    RealBoard bad = good;
    for (FrameDetections& frame : bad.detections.frames) {
      if (frame.set != "view_05" || frame.camera != "right") continue;
      const std::vector<Detection> straight = frame.detections;
      for (std::size_t i = 0; i < straight.size(); ++i) {
        const std::size_t from = fault == 0   ? straight.size() - 1 - i
                                 : fault == 1 ? i - i % 9 + (i + 1) % 9
                                              : (i * 37) % straight.size();
        frame.detections[i].centre_px = straight[from].centre_px;
      }
    }
    const JointResult result = calibrate_joint(bad.detections, bad.rig, bad.target, {});
    EXPECT_EQ(result.report.status, "good") << fault;
    EXPECT_THAT(result.report.rejected,
                Contains(AllOf(HasSubstr("view_05"), HasSubstr("not used"))))
        << fault;
    const JointResult whole = calibrate_joint(good.detections, good.rig, good.target, {});
    EXPECT_NEAR(result.report.cameras[0].focal_px, whole.report.cameras[0].focal_px,
                3 * whole.report.cameras[0].focal_sd_px)
        << fault;
  }
}

TEST(JointStart, KnownLensesPlaceCamerasFromTwoViews) {
  const RealBoard board = real_board("bouguet");
  const JointResult all = calibrate_joint(board.detections, board.rig, board.target, {});
  Rig few = board.rig;
  few.free_poses.resize(2);
  JointOptions options;
  options.known_lenses = all.calibration;
  const JointResult placed = calibrate_joint(board.detections, few, board.target, options);
  EXPECT_EQ(placed.report.status, "good");
  const auto baseline_mm = [](const JointResult& result) {
    const auto& cameras = result.calibration.cameras;
    return (centre_in_world(cameras[1].camera) - centre_in_world(cameras[0].camera)).norm() / mm;
  };
  EXPECT_NEAR(baseline_mm(placed), baseline_mm(all), 1.5);
  const auto& lens = std::get<BrownLens>(placed.calibration.cameras[0].camera.model.lens);
  const auto& known = std::get<BrownLens>(all.calibration.cameras[0].camera.model.lens);
  EXPECT_EQ(lens.fx_px, known.fx_px);
  // The lens is as uncertain as before, and the pose more than with a perfect lens.
  EXPECT_NEAR(placed.calibration.cameras[0].covariance(0, 0),
              all.calibration.cameras[0].covariance(0, 0), 1e-9);
}

TEST(JointStart, RefusesKnownLensesOfAnotherImageSize) {
  const RealBoard board = real_board("pose2sim-cam01");
  JointOptions options;
  options.known_lenses = calibrate_joint(board.detections, board.rig, board.target, {}).calibration;
  RealBoard other = board;
  other.rig.cameras[0].width_px = 544;
  for (FrameDetections& frame : other.detections.frames) frame.width_px = 544;
  EXPECT_THROW(
      static_cast<void>(calibrate_joint(other.detections, other.rig, other.target, options)),
      Error);
}

}  // namespace
}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#include "calib/joint/uncertainty.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/programs/ending.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/geometry/vectors.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape {
namespace {

using namespace calib;
using test::SyntheticBench;

std::vector<Eigen::Vector3d> places() {
  return grid_of({{-0.1, -0.08, 0}, {0.1, 0.08, 0.06}}, 3);
}

/// The same bench, recorded again with other noise and another position of the target.
Calibration calibration_from(const JointModel& truth, unsigned seed) {
  JointModel seen = truth;
  test::see(seen, 0.05, seed);
  JointModel model = test::forgotten(seen);
  start_joint(model);
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  return calibrate_joint(model, 0, options).calibration;
}

TEST(Drift, OfABenchThatStaysIsWhatTheUncertaintiesLetExpect) {
  int drifted = 0, all = 0;
  double ratio = 0;
  const int benches = test::trial_count(5, 100);
  for (int seed = 0; seed < benches; ++seed) {
    const JointModel truth = SyntheticBench(static_cast<unsigned>(seed), 10).true_model();
    JointModel elsewhere = truth;  // another world: the whole bench rotated about the target
    const Eigen::Matrix3d turn = rotation_about(Eigen::Vector3d(0.01, -0.02, 0.03));
    for (JointCamera& camera : elsewhere.cameras) {
      CamFromWorld& pose = camera.camera.cam_from_world;
      pose.translation_m += pose.rotation * Eigen::Vector3d(0.001, 0.002, -0.001);
      pose.rotation = pose.rotation * turn;
    }
    const Drift drift =
        drift_between(calibration_from(truth, static_cast<unsigned>(seed) + 100),
                      calibration_from(elsewhere, static_cast<unsigned>(seed) + 900), places());
    ASSERT_EQ(drift.cameras.size(), 3u);
    for (const CameraDrift& camera : drift.cameras) {
      drifted += camera.drifted();
      ++all;
    }
    ratio += drift.moved_mm / drift.expected_mm / benches;
  }
  EXPECT_LE(drifted, all / 100);
  EXPECT_GT(ratio, 0.4);
  EXPECT_LT(ratio, 1.3);
}

TEST(Drift, NamesTheCameraWhoseLensTurned) {
  const JointModel truth = SyntheticBench(3, 10).true_model();
  JointModel later = truth;
  std::get<BrownLens>(later.cameras[2].camera.model.lens).cx_px += 1.0;
  std::get<BrownLens>(later.cameras[2].camera.model.lens).fx_px *= 1.002;
  std::get<BrownLens>(later.cameras[2].camera.model.lens).fy_px *= 1.002;
  const Drift drift =
      drift_between(calibration_from(truth, 1), calibration_from(later, 2), places());
  EXPECT_TRUE(drift.cameras.at(2).drifted());
  EXPECT_GT(drift.cameras[2].moved_px, drift.cameras[0].moved_px);
  EXPECT_GT(drift.moved_mm, 3 * drift.expected_mm);
}

TEST(Drift, SinceANoGoCalibrationIsWarnedOf) {
  Calibration old = calibration_from(SyntheticBench(3).true_model(), 1);
  Target target;
  target.rows = target.cols = 11;
  target.pitch_m = 0.018;
  const auto warnings = [&] {
    Ending ending;
    add_drift(ending, old, old, {}, target);
    return ending.warnings;
  };
  EXPECT_THAT(warnings(), testing::IsEmpty());
  old.no_go = "cam1 misses by 3 px";
  EXPECT_THAT(warnings(), testing::ElementsAre(testing::HasSubstr("NO-GO")));
}

TEST(Drift, NeedsACameraInCommon) {
  Calibration old = calibration_from(SyntheticBench(3).true_model(), 1), now = old;
  for (CalibratedCamera& camera : now.cameras) camera.camera.name += "_new";
  EXPECT_THROW(static_cast<void>(drift_between(old, now, places())), Error);
}

}  // namespace
}  // namespace drape

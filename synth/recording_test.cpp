// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "synth/synth.hpp"
#include "synth/test_cameras.hpp"
#include "tests/support/paths.hpp"

namespace drape::test {
namespace {

using namespace drape::synth;
using testing::HasSubstr;
using units::mm;

Rig bench_rig() {
  return read_rig(source_root() / "rigs/bench1/rig.toml");
}

TEST(SyntheticRecording, IsReadAsAnyOtherAndSaysTheTruth) {
  const TemporaryFolder folder;
  SynthOptions options;
  options.sets = {"stage_z030", "drape_A"};
  const std::vector<Camera> cameras = three_synthetic_cameras(40);
  const SynthReport report =
      write_synthetic_recording(bench_rig(), cameras, folder.path() / "r", options);
  EXPECT_EQ(report.pictures, 6);
  EXPECT_THAT(report.not_over_objects, testing::ElementsAre("drape_A"));
  const Recording recording = read_recording(folder.path() / "r");
  ASSERT_EQ(recording.sets.size(), 2U);
  for (const FrameSet& set : recording.sets) {
    for (const RecordedFrame& frame : set.frames)
      EXPECT_FALSE(read_frame(recording, set, frame).empty());
  }
  const Truth truth = read_record<Truth>(folder.path() / "r/truth.json");
  ASSERT_EQ(truth.sets.size(), 2U);
  EXPECT_EQ(truth.sets[0].shows, Surface::target);
  const TrueMark& mark = truth.sets[0].marks.front();
  EXPECT_LT((mark.point_in_world - Eigen::Vector3d(-110, -80, 30) * mm).norm(), 1e-12);
  const TrueMarkView& seen = mark.views[1];
  const auto image = project(
      cameras[1].model, cameras[1].cam_from_world * Eigen::Vector3d(-110 * mm, -80 * mm, 30 * mm));
  EXPECT_EQ(seen.camera, "cam1");
  EXPECT_LT((*seen.px - image->px).norm(), 1e-9);
  EXPECT_EQ(seen.visible_fraction, 1);
  const Calibration calibration = read_calibration(folder.path() / "r/true_calibration.json");
  EXPECT_EQ(calibration.cameras.size(), 3U);
  EXPECT_THROW((void)write_synthetic_recording(bench_rig(), cameras, folder.path() / "r", options),
               Error);
}

TEST(SyntheticRecording, RefusesAnUnknownSetByName) {
  const TemporaryFolder folder;
  SynthOptions options;
  options.sets = {"drape_Z"};
  try {
    (void)write_synthetic_recording(bench_rig(), three_synthetic_cameras(40), folder.path() / "r",
                                    options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("drape_Z"));
    EXPECT_THAT(error.what(), HasSubstr("stage_z000"));
  }
}

TEST(PlannedCameras, LookWhereThePlanSays) {
  const TemporaryFolder folder;
  write_durable(folder.path() / "plan.toml",
                "schema = \"drapebench/cameras-plan/1\"\n"
                "[[camera]]\nname = \"cam1\"\nfocal_mm = 10.7\nposition_mm = [0, -500, 600]\n"
                "[[camera]]\nname = \"cam0\"\nfocal_mm = 10.7\nposition_mm = [400, 0, 600]\n"
                "look_at_mm = [0, 0, 40]\nk1 = -0.1\n"
                "[[camera]]\nname = \"cam2\"\nfocal_mm = 10.7\nposition_mm = [0, 0, 700]\n");
  const auto cameras = read_planned_cameras(folder.path() / "plan.toml", bench_rig());
  ASSERT_EQ(cameras.size(), 3U);
  EXPECT_EQ(cameras[0].name, "cam0");
  EXPECT_LT((centre_in_world(cameras[1]) - Eigen::Vector3d(0, -0.5, 0.6)).norm(), 1e-12);
  const Eigen::Vector3d target_in_camera = cameras[0].cam_from_world * Eigen::Vector3d(0, 0, 0.04);
  const auto image = project(cameras[0].model, target_in_camera);
  EXPECT_LT((image->px - Eigen::Vector2d(799.5, 599.5)).norm(), 1e-9);
  EXPECT_GT(cameras[2].cam_from_world.rotation.determinant(), 0.999);
  write_durable(folder.path() / "short.toml",
                "schema = \"drapebench/cameras-plan/1\"\n"
                "[[camera]]\nname = \"cam0\"\nfocal_mm = 10.7\nposition_mm = [400, 0, 600]\n");
  EXPECT_THROW((void)read_planned_cameras(folder.path() / "short.toml", bench_rig()), Error);
}

}  // namespace
}  // namespace drape::test

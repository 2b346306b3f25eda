// SPDX-License-Identifier: Apache-2.0
#include "calib/joint.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#include "calib/test_targets.hpp"
#include "core/error.hpp"
#include "core/files/files.hpp"
#include "core/units.hpp"
#include "tests/support/paths.hpp"

namespace drape::calib {
namespace {

using test::bench1_target;
using test::bench1_target_detections;
using test::SyntheticBench;
using testing::HasSubstr;
using units::mm;

Rig bench1_with_free_poses() {
  Rig rig = test::bench1_rig();
  for (int i = 0; i < 15; ++i)
    rig.free_poses.push_back("pose_" + std::string(i < 10 ? "0" : "") + std::to_string(i));
  return rig;
}

JointResult calibrate_bench1(const Detections& detections, const JointOptions& options = {}) {
  return calibrate_joint(detections, bench1_with_free_poses(), bench1_target(), options);
}

TEST(Joint, FindsBench1sCamerasWithinAHundredthOfAPercentAnd30Micrometres) {
  const JointResult result = calibrate_bench1(bench1_target_detections(0.01));
  EXPECT_EQ(result.report.status, "good");
  ASSERT_EQ(result.calibration.cameras.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    const Camera& truth = test::bench1_truth().cameras[i];
    const Camera& found = result.calibration.cameras[i].camera;
    const auto &lens = std::get<BrownLens>(found.model.lens),
               &true_lens = std::get<BrownLens>(truth.model.lens);
    EXPECT_NEAR(lens.fx_px / true_lens.fx_px, 1, 1e-4) << found.name;
    EXPECT_NEAR(lens.fy_px / true_lens.fy_px, 1, 1e-4) << found.name;
    EXPECT_LT((centre_in_world(found) - centre_in_world(truth)).norm() / mm, 0.03) << found.name;
    EXPECT_EQ(result.calibration.cameras[i].covariance.rows(), 15);
  }
  // The renderer's lens has k1 and k2; a larger model must not be worth its parameters.
  EXPECT_EQ(result.report.lens, LensTerms::k1_k2);
  EXPECT_EQ(result.report.held_out.size(), 4u);
  EXPECT_NEAR(result.report.chi2_per_dof, 1, 0.05);
  // The renderer's plate is flat.
  EXPECT_LT(result.report.print.head<2>().norm(), 4 * result.report.print_sd.head<2>().norm());
  EXPECT_EQ(result.calibration.joint_covariance.rows(), 45);
  EXPECT_EQ(result.calibration.joint_covariance_parameters[15], "cam1/fx_px");
  EXPECT_THAT(result.report.next_view, HasSubstr("target tilted by"));
}

TEST(Joint, CamerasThatAreExchangedInSomeSetsAreNamed) {
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  // Adjacent cameras, and two on opposite sides of the target; in one set, or in most.
  for (const auto& [first, second] : {std::pair("cam0", "cam1"), std::pair("cam0", "cam2")}) {
    for (const std::string where : {"pose_03", "pose"}) {
      Detections detections = bench1_target_detections(0.01);
      for (FrameDetections& frame : detections.frames) {
        if (!frame.set.starts_with(where)) continue;
        if (frame.camera == first)
          frame.camera = second;
        else if (frame.camera == second)
          frame.camera = first;
      }
      const JointResult result = calibrate_bench1(detections, options);
      const std::string odd =
          where == "pose" ? "stage_z000, stage_z030, stage_z060, stage_z090" : where;
      EXPECT_THAT(result.report.status, HasSubstr(std::string(first) + " and " + second +
                                                  " are exchanged in " + odd + " against"));
      EXPECT_FALSE(result.report.good());
    }
  }
}

TEST(Joint, LabelsThatAreTurnedRoundOnATargetThatLooksTheSameAreNamed) {
  JointOptions options;
  options.lens = LensTerms::k1_k2;
  Detections detections = bench1_target_detections(0.01);
  for (FrameDetections& frame : detections.frames) {
    if (frame.set != "pose_03" || frame.camera != "cam1") continue;
    for (Detection& dot : frame.detections) dot.mark = {8 - dot.mark.row, 11 - dot.mark.col};
    std::reverse(frame.detections.begin(), frame.detections.end());
  }
  EXPECT_THAT(calibrate_bench1(detections, options).report.status,
              HasSubstr("half a turn, and set pose_03 is labelled otherwise by cam1 than by cam0"));
  // One view in common agrees however it is labelled.
  std::erase_if(detections.frames, [](const FrameDetections& frame) {
    const bool is_stage = frame.set.starts_with("stage");
    return frame.camera == "cam1" ? is_stage || frame.set < "pose_05"
                                  : !is_stage && frame.set > "pose_05";
  });
  EXPECT_THAT(calibrate_bench1(detections, options).report.status,
              HasSubstr("the place of cam1 rests on one view in common"));
}

TEST(Joint, SameInputSameBytes) {
  test::TemporaryFolder folder;
  for (const char* name : {"a.json", "b.json"}) {
    write_calibration(folder.path() / name,
                      calibrate_bench1(bench1_target_detections(0.01)).calibration);
  }
  EXPECT_EQ(read_text(folder.path() / "a.json"), read_text(folder.path() / "b.json"));
}

TEST(Joint, CovarianceOfAllCamerasComesBackFromTheFile) {
  test::TemporaryFolder folder;
  const Calibration written = calibrate_bench1(bench1_target_detections(0.01)).calibration;
  write_calibration(folder.path() / "calibration.json", written);
  const Calibration read = read_calibration(folder.path() / "calibration.json");
  EXPECT_EQ(read.joint_covariance_parameters, written.joint_covariance_parameters);
  EXPECT_EQ(read.joint_covariance, written.joint_covariance);
  EXPECT_EQ(read.target_covariance, written.target_covariance);
}

TEST(Joint, RejectsAMislabelledDotByName) {
  Detections detections = bench1_target_detections(0.01);
  for (FrameDetections& frame : detections.frames) {
    if (frame.set == "pose_03" && frame.camera == "cam1")
      frame.detections[40].centre_px += Eigen::Vector2d(3, -2);
  }
  const JointResult result = calibrate_bench1(detections);
  EXPECT_TRUE(result.report.good());
  ASSERT_EQ(result.report.rejected.size(), 1u);
  EXPECT_THAT(result.report.rejected[0], HasSubstr("set pose_03, cam1, dot (3, 4)"));
}

TEST(Joint, FlagsAViewAboveTwiceTheMedianByName) {
  Detections detections = bench1_target_detections(0.01);
  unsigned i = 0;
  for (FrameDetections& frame : detections.frames) {
    if (frame.set != "pose_07" || frame.camera != "cam2") continue;
    for (Detection& d : frame.detections) {
      d.centre_px += Eigen::Vector2d(i % 2 == 0 ? 0.03 : -0.03, i % 3 == 0 ? 0.03 : -0.02);
      ++i;
    }
  }
  const JointResult result = calibrate_bench1(detections);
  EXPECT_THAT(result.calibration.warnings, testing::Contains(HasSubstr("set pose_07, cam2: RMS")));
}

TEST(Joint, TheEccentricityOfTheDotsWouldBeABias) {
  JointOptions without;
  without.common.correct_eccentricity = false;
  const auto off_mm = [](const JointResult& result) {
    double sum = 0;
    for (int i = 0; i < 3; ++i)
      sum += (centre_in_world(result.calibration.cameras[i].camera) -
              centre_in_world(test::bench1_truth().cameras[i]))
                 .norm() /
             mm / 3;
    return sum;
  };
  const Detections exact = bench1_target_detections(0);
  EXPECT_LT(off_mm(calibrate_bench1(exact)), 0.002);
  EXPECT_GT(off_mm(calibrate_bench1(exact, without)), 0.004);
}

TEST(Joint, DerivativesEqualDifferences) {
  const SyntheticBench bench(3);
  const JointModel& model = bench.true_model();
  const JointCamera camera = [&] {
    JointCamera c = model.cameras[1];
    c.skew_px = 0.7;
    return c;
  }();
  const Placement& placement = model.placements[2];
  const Eigen::Vector3d point(0.05, -0.03, 0);
  const TargetImage image = *image_of(camera, placement, model.board, point);
  const auto& l = std::get<BrownLens>(camera.camera.model.lens);
  const Eigen::Vector3d t = camera.camera.cam_from_world.translation_m / mm;
  const double base[camera_parameters] = {l.fx_px, l.fy_px, l.cx_px, l.cy_px, l.k1, l.k2,
                                          l.p1,    l.p2,    l.k3,    0.7,     0,    0,
                                          0,       t.x(),   t.y(),   t.z()};
  for (int i = 0; i < camera_parameters; ++i) {
    const double step = 1e-6 * std::max(1.0, std::abs(base[i]));
    double low[camera_parameters], high[camera_parameters];
    std::copy(base, base + camera_parameters, low);
    std::copy(base, base + camera_parameters, high);
    low[i] -= step;
    high[i] += step;
    const Eigen::Vector2d slope = (*pixel_of(moved(camera, high), placement, model.board, point) -
                                   *pixel_of(moved(camera, low), placement, model.board, point)) /
                                  (2 * step);
    EXPECT_LT((slope - image.by_camera.col(i)).norm(), 1e-5 * (1 + slope.norm())) << i;
  }
  Board bent = model.board;
  bent.edge_rise_mm.x() += 1e-3;
  const Eigen::Vector2d slope = (*pixel_of(camera, placement, bent, point) - image.px) / 1e-3;
  EXPECT_LT((slope - image.by_board.col(0)).norm(), 1e-4);
}

/// Zhang's corners: one camera, five views. His axes have y down and z away from the camera, so
/// they are rotated by half a turn about x into this project's.
JointModel zhang_views(const std::filesystem::path& folder) {
  JointModel model;
  JointCamera camera;
  camera.camera.name = "zhang";
  camera.camera.model = {BrownLens{}, 640, 480};
  model.cameras.push_back(camera);
  for (int view = 0; view < 5; ++view) {
    model.placements.push_back({"view" + std::to_string(view + 1), {}, view == 0});
    JointFrame frame{0, static_cast<std::size_t>(view), {}};
    std::istringstream flat(read_text(folder / "Model.txt"));
    std::istringstream seen(read_text(folder / ("data" + std::to_string(view + 1) + ".txt")));
    double x, y, u, v;
    for (int i = 0; flat >> x >> y && seen >> u >> v; ++i)
      frame.points.push_back({{i / 4, i % 4}, Eigen::Vector3d(x, -y, 0) * 25.4 * mm, {u, v}});
    model.frames.push_back(frame);
  }
  return model;
}

TEST(Joint, ZhangsSetGivesHisPublishedDigits) {
  const std::filesystem::path folder = drape::test::test_data("zhang-1998");
  JointModel model = zhang_views(folder);
  ASSERT_EQ(model.frames[4].points.size(), 256u);
  start_joint(model);
  JointFit fit;
  fit.lens = LensTerms::k1_k2;
  fit.skew = true;
  fit.board = BoardKind::drawn;
  const JointSolution solution = solve_joint(model, fit);
  EXPECT_TRUE(solution.converged);
  EXPECT_NEAR(std::sqrt(solution.chi2 / (5 * 256)), 0.336434, 1e-6);
  const auto& lens = std::get<BrownLens>(solution.model.cameras[0].camera.model.lens);
  EXPECT_NEAR(lens.fx_px, 832.5, 0.05);  // half a unit of the last published digit
  EXPECT_NEAR(solution.model.cameras[0].skew_px, 0.204494, 1e-5);
  EXPECT_NEAR(lens.fy_px, 832.53, 0.005);
  EXPECT_NEAR(lens.cx_px, 303.959, 5e-4);
  EXPECT_NEAR(lens.cy_px, 206.585, 5e-4);
  EXPECT_NEAR(lens.k1, -0.228601, 5e-6);
  EXPECT_NEAR(lens.k2, 0.190353, 5e-6);
  std::printf("Zhang: %.6f %.6f %.6f %.6f %.6f %.6f %.6f, RMS %.7f px\n", lens.fx_px,
              solution.model.cameras[0].skew_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1,
              lens.k2, std::sqrt(solution.chi2 / (5 * 256)));
  EXPECT_EQ(free_parameters(model, fit), 37);
}

}  // namespace
}  // namespace drape::calib

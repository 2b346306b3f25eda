// SPDX-License-Identifier: Apache-2.0
// Coverage of the stated uncertainties of a joint calibration, over simulated rigs.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/joint/uncertainty.hpp"
#include "calib/test_rigs.hpp"
#include "core/error.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"

namespace drape::calib {
namespace {

using test::SyntheticBench;
using units::mm;

/// Counts how often the truth is inside the 95 % interval.
struct Coverage {
  int inside = 0, all = 0;
  void add(double error, double variance) {
    inside += std::abs(error) <= 1.959964 * std::sqrt(variance);
    ++all;
  }
  [[nodiscard]] double fraction() const { return static_cast<double>(inside) / all; }
};

/// A fraction `part` of the points' noise is common to the points of a view, without being stated.
void expect_coverage(double part) {
  const int rigs = test::trial_count(8, 200);
  int stage_alarms = 0;
  Coverage focal, principal, position, turn;
  for (int seed = 0; seed < rigs; ++seed) {
    const SyntheticBench bench(static_cast<unsigned>(seed), 8, 0.05, part);
    JointOptions options;
    options.lens = LensTerms::k1_k2;
    JointModel model = bench.noisy_views();
    start_joint(model);
    const JointResult result = calibrate_joint(model, 0, options);
    ASSERT_TRUE(result.report.good()) << seed << ": " << result.report.status;
    stage_alarms += result.report.stages && !result.report.stages->findings.empty() ? 1 : 0;
    for (std::size_t c = 0; c < result.calibration.cameras.size(); ++c) {
      const CalibratedCamera& found = result.calibration.cameras[c];
      const Camera& truth = bench.true_model().cameras[c].camera;
      const auto &lens = std::get<BrownLens>(found.camera.model.lens),
                 &true_lens = std::get<BrownLens>(truth.model.lens);
      const Eigen::MatrixXd& s = found.covariance;
      focal.add(lens.fx_px - true_lens.fx_px, s(0, 0));
      focal.add(lens.fy_px - true_lens.fy_px, s(1, 1));
      principal.add(lens.cx_px - true_lens.cx_px, s(2, 2));
      principal.add(lens.cy_px - true_lens.cy_px, s(3, 3));
      const Eigen::Vector3d off = (centre_in_world(found.camera) - centre_in_world(truth)) / mm;
      const Eigen::Matrix3d off_covariance = centre_covariance_mm2(found);
      const auto vector_of = [](const Camera& camera) {
        const Eigen::AngleAxisd a(camera.cam_from_world.rotation);
        return Eigen::Vector3d(a.angle() * a.axis());
      };
      const Eigen::Vector3d turned = vector_of(found.camera) - vector_of(truth);
      for (int i = 0; i < 3; ++i) {
        position.add(off[i], off_covariance(i, i));
        if (turned.norm() < 1) turn.add(turned[i], s(9 + i, 9 + i));
      }
    }
  }
  std::printf(
      "common part %.2f: inside 95 %%: focal %.4f, principal %.4f, centre %.4f, turn %.4f of %d "
      "rigs\n",
      part, focal.fraction(), principal.fraction(), position.fraction(), turn.fraction(), rigs);
  // Six numbers of a kind per rig; allows three standard deviations of the sample's fraction beyond
  // the required 92 to 98 %.
  const double slack = rigs < 200 ? 3 * std::sqrt(0.95 * 0.05 / (6.0 * rigs)) : 0;
  for (const Coverage& kind : {focal, principal, position, turn}) {
    EXPECT_GE(kind.fraction(), 0.92 - slack);
    EXPECT_LE(kind.fraction(), 0.98 + slack);
  }
  // A correct stage appears off by four standard deviations in one of 16,000 figures.
  EXPECT_EQ(stage_alarms, 0);
}

TEST(JointCoverage, NinetyFivePercentIntervalsHoldWithIndependentNoise) {
  expect_coverage(0);
}

TEST(JointCoverage, AndWhereAPartIsCommonToThePointsOfAView) {
  expect_coverage(0.1);
}

}  // namespace
}  // namespace drape::calib

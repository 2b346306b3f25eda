// SPDX-License-Identifier: Apache-2.0
// Joint calibration of 3 cameras from 19 placements of 108 points, compared with
// cv::calibrateCamera, if available, on the same points (per camera, k1 k2, no covariance, no
// common placements).
#include <benchmark/benchmark.h>

#include "calib/joint.hpp"
#include "calib/joint/start.hpp"
#include "calib/test_rigs.hpp"
#ifdef DRAPE_HAS_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

namespace drape::calib {
namespace {

JointModel views() {
  return test::SyntheticBench(1, 17, 0.01).noisy_views();
}

/// Everything that `drape calib --method joint` does after reading its files: start, lens choice by
/// held-out error, rejection, fit, covariance, next view.
void all_of_it(benchmark::State& state) {
  const JointModel seen = views();
  for ([[maybe_unused]] auto _ : state) {
    JointModel model = seen;
    start_joint(model);
    benchmark::DoNotOptimize(calibrate_joint(model, 0.008, {}));
  }
}
BENCHMARK(all_of_it)->Unit(benchmark::kMillisecond);

/// Least squares only, with lens k1 k2 and no bow, like the baseline.
void fit_alone(benchmark::State& state) {
  const JointModel seen = views();
  JointFit fit;
  fit.lens = LensTerms::k1_k2;
  fit.board = BoardKind::drawn;
  for ([[maybe_unused]] auto _ : state) {
    JointModel model = seen;
    start_joint(model);
    benchmark::DoNotOptimize(solve_joint(std::move(model), fit));
  }
}
BENCHMARK(fit_alone)->Unit(benchmark::kMillisecond);

#ifdef DRAPE_HAS_CALIB3D
void baseline_opencv(benchmark::State& state) {
  const JointModel seen = views();
  std::vector<std::vector<std::vector<cv::Point3f>>> points(3);
  std::vector<std::vector<std::vector<cv::Point2f>>> pixels(3);
  for (const JointFrame& frame : seen.frames) {
    points[frame.camera].emplace_back();
    pixels[frame.camera].emplace_back();
    for (const TargetPoint& p : frame.points) {
      points[frame.camera].back().emplace_back(static_cast<float>(p.point_in_target.x()),
                                               static_cast<float>(p.point_in_target.y()), 0.0F);
      pixels[frame.camera].back().emplace_back(static_cast<float>(p.measured_px.x()),
                                               static_cast<float>(p.measured_px.y()));
    }
  }
  cv::setNumThreads(1);
  for ([[maybe_unused]] auto _ : state) {
    for (std::size_t c = 0; c < 3; ++c) {
      cv::Mat k, lens;
      std::vector<cv::Mat> turns, shifts;
      benchmark::DoNotOptimize(cv::calibrateCamera(points[c], pixels[c], {1600, 1200}, k, lens,
                                                   turns, shifts,
                                                   cv::CALIB_ZERO_TANGENT_DIST | cv::CALIB_FIX_K3));
    }
  }
}
BENCHMARK(baseline_opencv)->Unit(benchmark::kMillisecond);
#endif

}  // namespace
}  // namespace drape::calib

// SPDX-License-Identifier: Apache-2.0
// Time per point compared with the linear method of textbooks (Hartley and Zisserman 2004, 12.2) on
// undistorted rays, which gives neither covariance nor weights.
#include <benchmark/benchmark.h>

#include <Eigen/SVD>
#include <random>

#include "core/units.hpp"
#include "triangulate/point.hpp"
#include "triangulate/test_bench.hpp"

namespace drape::triangulate {
namespace {

constexpr double kMinAngle = 2 * units::deg;

/// Views of points all over the bench, with 0.05 px of noise.
std::vector<std::vector<View>> many_views(const test::Bench& bench, int cameras) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-0.1, 0.1);
  std::normal_distribution<double> noise(0, 0.05);
  std::vector<std::vector<View>> all;
  for (int i = 0; i < 256; ++i) {
    all.push_back(bench.views({place(random), place(random), place(random)}, cameras,
                              0.0025 * Eigen::Matrix2d::Identity()));
    for (View& view : all.back()) view.px += Eigen::Vector2d(noise(random), noise(random));
  }
  return all;
}

Eigen::Vector3d linear(const std::vector<View>& views) {
  Eigen::Matrix<double, Eigen::Dynamic, 4> rows(2 * views.size(), 4);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera->camera;
    const Eigen::Vector3d ray = *unproject(camera.model, views[i].px);
    Eigen::Matrix<double, 3, 4> pose;
    pose << camera.cam_from_world.rotation, camera.cam_from_world.translation_m;
    const auto row = 2 * static_cast<Eigen::Index>(i);
    rows.row(row) = ray.x() / ray.z() * pose.row(2) - pose.row(0);
    rows.row(row + 1) = ray.y() / ray.z() * pose.row(2) - pose.row(1);
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullV);
  return svd.matrixV().col(3).hnormalized();
}

void linear_svd_baseline(benchmark::State& state) {
  const test::Bench bench;
  const auto views = many_views(bench, static_cast<int>(state.range(0)));
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(linear(views[i++ % views.size()]));
}
BENCHMARK(linear_svd_baseline)->DenseRange(2, 4);

void weighted_with_covariance(benchmark::State& state) {
  const test::Bench bench;
  const auto views = many_views(bench, static_cast<int>(state.range(0)));
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state)
    benchmark::DoNotOptimize(solve_point(views[i++ % views.size()], kMinAngle));
}
BENCHMARK(weighted_with_covariance)->DenseRange(2, 4);

}  // namespace
}  // namespace drape::triangulate

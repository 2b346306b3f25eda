// SPDX-License-Identifier: Apache-2.0
// Compares statistics of triangulated points over many noisy trials with theory.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstdio>
#include <random>

#include "core/camera_model.hpp"
#include "core/units.hpp"
#include "tests/support/trials.hpp"
#include "triangulate/dots.hpp"
#include "triangulate/test_bench.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Bench;
using units::deg;
using units::mm;

constexpr double kMinAngle = 2 * deg;

/// Cramer-Rao bound: inverse of the Fisher information about the point in pixels with this noise.
Matrix3d cramer_rao(const std::vector<View>& views, const Vector3d& truth) {
  Matrix3d information = Matrix3d::Zero();
  for (const View& view : views) {
    const Camera& camera = view.camera->camera;
    const Eigen::Matrix<double, 2, 3> by_place =
        project(camera.model, camera.cam_from_world * truth)->d_px_d_point *
        camera.cam_from_world.rotation;
    information += by_place.transpose() * view.covariance_px2.inverse() * by_place;
  }
  return information.inverse();
}

TEST(PointAccuracy, IsThatOfTheCramerRaoBoundWithAnHonestCovariance) {
  const Bench bench;
  std::mt19937 random(17);
  std::normal_distribution<double> normal(0, 1);
  Matrix2d covariance;
  covariance << 0.0025, 0.001, 0.001, 0.004;
  const Matrix2d lower = covariance.llt().matrixL();
  const int trials = test::trial_count(20000, 200000);
  for (int count = 2; count <= 3; ++count) {
    const Vector3d truth(0.02, -0.03, 0.04);
    const auto exact = bench.views(truth, count, covariance);
    double squared = 0, mahalanobis = 0;
    for (int trial = 0; trial < trials; ++trial) {
      auto views = exact;
      for (View& view : views) view.px += lower * Vector2d(normal(random), normal(random));
      const Point point = solve_point(views, kMinAngle);
      ASSERT_EQ(point.status, PointStatus::good);
      const Vector3d error = point.in_world - truth;
      squared += error.squaredNorm() / trials;
      mahalanobis += error.dot(point.covariance_m2().llt().solve(error)) / trials;
    }
    const double ratio = std::sqrt(squared / cramer_rao(exact, truth).trace());
    std::printf("%d cameras: RMS %.5f mm, %.4f of the Cramer-Rao bound, Mahalanobis^2 %.3f\n",
                count, std::sqrt(squared) / mm, ratio, mahalanobis);
    // The RMS over 20000 trials is known to 0.5 %, the mean squared Mahalanobis distance to 0.017.
    EXPECT_NEAR(ratio, 1, 0.02);
    EXPECT_NEAR(mahalanobis, 3, 0.15);
  }
}

/// A dot's image in each view, for a patch drawn from its estimated distribution.
std::vector<View> images_of_bent_dot(const std::vector<View>& exact, const Vector3d& truth,
                                     const SurfacePatch& patch, double diameter_m) {
  std::vector<View> views = exact;
  for (View& view : views) {
    const Camera& camera = view.camera->camera;
    const Matrix3d& rotation = camera.cam_from_world.rotation;
    view.px = *dot_centroid_px(camera.model,
                               {camera.cam_from_world * truth, rotation * patch.axis_u,
                                rotation * patch.axis_v, diameter_m / 2, patch.curvature_per_m});
  }
  return views;
}

/// A patch with curvatures and tilts drawn from its own uncertainty.
SurfacePatch drawn(SurfacePatch patch, const CurvatureTrust& trust, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  const Vector3d sigma = patch.curvature_variance(trust).cwiseSqrt();
  patch.curvature_per_m(0, 0) += sigma[0] * normal(random);
  patch.curvature_per_m(0, 1) += sigma[1] * normal(random);
  patch.curvature_per_m(1, 0) = patch.curvature_per_m(0, 1);
  patch.curvature_per_m(1, 1) += sigma[2] * normal(random);
  const Eigen::AngleAxisd about_u(patch.normal_sigma_rad * normal(random), patch.axis_u);
  const Eigen::AngleAxisd about_v(patch.normal_sigma_rad * normal(random), patch.axis_v);
  const Matrix3d turn = (about_u * about_v).toRotationMatrix();
  patch.axis_u = turn * patch.axis_u;
  patch.axis_v = turn * patch.axis_v;
  return patch;
}

TEST(PointAccuracy, CovarianceHoldsForDotsOfUnknownBend) {
  const Bench bench;
  constexpr double kDiameter = 4 * mm, kNoisePx = 0.02;
  SurfacePatch known;
  known.axis_u = Vector3d::UnitX();
  known.axis_v = Vector3d::UnitY();
  known.curvature_per_m << 40, 5, 5, -10;
  known.noise_per_m.setZero();
  known.strongest_per_m = {40, 15, 10};
  known.normal_sigma_rad = 0.02;
  const CurvatureTrust trust{10, 0.5};
  const Vector3d truth(0.01, 0.02, 0.03);
  std::mt19937 random(23);
  std::normal_distribution<double> normal(0, 1);
  const int trials = test::trial_count(3000, 30000);
  for (int count = 2; count <= 3; ++count) {
    const auto exact = bench.views(truth, count, kNoisePx * kNoisePx * Matrix2d::Identity());
    double mahalanobis = 0, chi2 = 0, joint = 0, apart = 0;
    for (int trial = 0; trial < trials; ++trial) {
      auto views = images_of_bent_dot(exact, truth, drawn(known, trust, random), kDiameter);
      for (View& view : views) view.px += kNoisePx * Vector2d(normal(random), normal(random));
      auto corrected = without_dot_shape(views, truth, known, trust, kDiameter);
      const Point point = solve_point(corrected, kMinAngle);
      const Vector3d error = point.in_world - truth;
      mahalanobis += error.dot(point.covariance_m2().llt().solve(error)) / trials;
      chi2 += point.chi2 / trials;
      joint += error.squaredNorm() / trials;
      for (View& view : corrected) view.shape_px = SharedUnknowns(2, 0);
      apart += (solve_point(corrected, kMinAngle).in_world - truth).squaredNorm() / trials;
    }
    std::printf(
        "%d cameras: RMS %.4f mm (bend not solved with the place: %.4f), Mahalanobis^2 %.2f\n",
        count, std::sqrt(joint) / mm, std::sqrt(apart) / mm, mahalanobis);
    // Known to sqrt(6/3000) = 0.045; allows four of these, and a bend of 40/m is not quite linear.
    EXPECT_NEAR(mahalanobis, 3, 0.25);
    EXPECT_NEAR(chi2, 2 * count - 3, 0.25);
    EXPECT_LE(joint, apart * 1.01);
  }
}

}  // namespace
}  // namespace drape::triangulate

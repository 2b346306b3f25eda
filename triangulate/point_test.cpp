// SPDX-License-Identifier: Apache-2.0
#include "triangulate/point.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <random>

#include "core/camera_model.hpp"
#include "core/units.hpp"
#include "triangulate/dots.hpp"
#include "triangulate/test_bench.hpp"

namespace drape::triangulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using units::deg;
using units::mm;

using test::Bench;
using test::camera_at;

constexpr double kLeastAngle = 2 * deg;

TEST(Point, IsRecoveredExactlyFromAnyNumberOfViews) {
  const Bench bench;
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-0.1, 0.1);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d truth(place(random), place(random), place(random));
    for (int count = 2; count <= 4; ++count) {
      const Point point =
          solve_point(bench.views(truth, count, 0.01 * Eigen::Matrix2d::Identity()), kLeastAngle);
      ASSERT_EQ(point.status, PointStatus::good);
      EXPECT_LT((point.in_world - truth).norm(), 1e-9 * mm);
      EXPECT_LT(point.rms_px(), 1e-8);
    }
  }
}

TEST(Point, MahalanobisErrorIsThreeOverManyNoisyTrials) {
  const Bench bench;
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  Eigen::Matrix2d covariance;
  covariance << 0.01, 0.006, 0.006, 0.02;
  const Eigen::Matrix2d lower = covariance.llt().matrixL();
  constexpr int kTrials = 3000;
  for (int count = 2; count <= 4; ++count) {
    double sum = 0, chi2 = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3d truth(0.02, -0.03, 0.04);
      auto views = bench.views(truth, count, covariance);
      for (View& view : views) view.px += lower * Vector2d(normal(random), normal(random));
      const Point point = solve_point(views, kLeastAngle);
      ASSERT_EQ(point.status, PointStatus::good);
      const Vector3d error = point.in_world - truth;
      sum += error.dot(point.detection_covariance_m2.llt().solve(error)) / kTrials;
      chi2 += point.chi2 / kTrials;
    }
    // Chi-square with 3 degrees has variance 6: its mean over 3000 trials is known to 0.045.
    EXPECT_NEAR(sum, 3, 4 * 0.045);
    EXPECT_NEAR(chi2, 2 * count - 3, 4 * std::sqrt(2.0 * (2 * count - 3) / kTrials));
  }
}

TEST(Point, CalibrationPartAgreesWithDisturbedCameras) {
  // The point from exact pixels, solved with cameras drawn from their covariance.
  Bench bench;
  Eigen::VectorXd sigma(11);
  sigma << 0.002, 1e-6, 0.3, 0.3, 1e-5, 1e-4, 1e-4, 1e-4, 0.02, 0.02, 0.05;
  bench.cameras = {camera_at(0, true, "cam0"), camera_at(60, true, "cam1"),
                   camera_at(180, true, "cam2")};
  for (CalibratedCamera& camera : bench.cameras) camera.covariance = sigma.cwiseAbs2().asDiagonal();
  const Vector3d truth(0.03, 0.02, 0.05);
  const auto views = bench.views(truth, 3, 0.01 * Eigen::Matrix2d::Identity());
  const Matrix3d predicted = solve_point(views, kLeastAngle).calibration_covariance_m2;
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0, 1);
  Matrix3d scatter = Matrix3d::Zero();
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<CalibratedCamera> moved = bench.cameras;
    auto moved_views = views;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      Camera& camera = moved[i].camera;
      auto& lens = std::get<TsaiLens>(camera.model.lens);
      lens.focal_m += sigma[0] * normal(random) * mm;
      lens.kappa1_per_m2 += sigma[1] * normal(random) / (mm * mm);
      lens.cx_px += sigma[2] * normal(random);
      lens.cy_px += sigma[3] * normal(random);
      lens.scale_x += sigma[4] * normal(random);
      const Eigen::AngleAxisd turn(camera.cam_from_world.rotation);
      Vector3d w = turn.angle() * turn.axis();
      for (int axis = 0; axis < 3; ++axis) {
        w[axis] += sigma[5 + axis] * normal(random);
        camera.cam_from_world.translation_m[axis] += sigma[8 + axis] * normal(random) * mm;
      }
      camera.cam_from_world.rotation =
          Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
      moved_views[i].camera = &moved[i];
    }
    const Vector3d error = solve_point(moved_views, kLeastAngle).in_world - truth;
    scatter += error * error.transpose() / kTrials;
  }
  // Each variance is known to sqrt(2/4000) = 2.2 %; allows five of these and the linearisation.
  const Matrix3d whitener = predicted.llt().matrixL().solve(Matrix3d::Identity());
  EXPECT_LT((whitener * scatter * whitener.transpose() - Matrix3d::Identity()).norm(), 0.2);
}

TEST(Point, ParallelRaysAreNotObservableAndNeverThrow) {
  CalibratedCamera left = camera_at(0, true, "left"), right = left;
  right.camera.cam_from_world.translation_m.x() += 1 * mm;
  const Vector3d point(0.01, 0, 0);
  std::vector<View> views;
  for (const CalibratedCamera* camera : {&left, &right}) {
    views.push_back({camera,
                     project(camera->camera.model, camera->camera.cam_from_world * point)->px,
                     0.01 * Eigen::Matrix2d::Identity()});
  }
  EXPECT_EQ(solve_point(views, kLeastAngle).status, PointStatus::not_observable);
  views.pop_back();
  EXPECT_EQ(solve_point(views, kLeastAngle).status, PointStatus::not_observable);
}

/// Adds the ellipse of a small dot with this normal to each view.
void add_ellipses(std::vector<View>& views, const Vector3d& point, const Vector3d& normal,
                  double diameter_m) {
  for (View& view : views) {
    const Camera& camera = view.camera->camera;
    const Eigen::Matrix<double, 2, 3> map =
        project(camera.model, camera.cam_from_world * point)->d_px_d_point *
        camera.cam_from_world.rotation * diameter_m / 2;
    const Vector2d shortened = map * normal;
    const Eigen::Matrix2d shape = map * map.transpose() - shortened * shortened.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(shape);
    view.semi_axes_px = axes.eigenvalues().reverse().cwiseSqrt();
    const Vector2d major = axes.eigenvectors().col(1);
    view.axis_angle_rad = std::atan2(major.y(), major.x());
  }
}

TEST(DotNormal, ComesBackFromTheEllipsesOfTwoViews) {
  const Bench bench;
  std::mt19937 random(8);
  std::normal_distribution<double> normal_draw(0, 0.3);
  int checked = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const Vector3d normal =
        Vector3d(0.3 + normal_draw(random), 0.1 + normal_draw(random), 1).normalized();
    auto views = bench.views({0, 0, 0}, 2, 0.01 * Eigen::Matrix2d::Identity());
    add_ellipses(views, {0, 0, 0}, normal, 4 * mm);
    const auto found = normal_from_ellipses(views, {0, 0, 0}, 4 * mm);
    if (!found) continue;
    ++checked;
    // A second tilt can explain two views nearly as well; the printed side decides most cases.
    EXPECT_LT(found->misfit, 0.01);
    EXPECT_LT(std::acos(std::min(1.0, found->normal.dot(normal))), 1.5 * deg) << trial;
  }
  EXPECT_GE(checked, 45);
}

TEST(DotShape, CurvatureOfACylinderComesFromPlacesAndNormals) {
  // Marks every 20 mm along a cylinder of 30 mm radius about the world's y axis; rows go around it.
  const double bend = 30 * mm, pitch = 20 * mm;
  MarksOnSurface marks;
  for (int row = -1; row <= 1; ++row) {
    for (int col = -1; col <= 1; ++col) {
      const double angle = row * pitch / bend;
      const Vector3d normal(std::sin(angle), 0, std::cos(angle));
      marks[{row, col}] = {bend * normal + Vector3d(0, col * pitch, 0), DotNormal{normal, 0.01, 0}};
    }
  }
  const SurfacePatch patch = surface_patch(marks, {0, 0}, pitch, Vector3d::UnitZ());
  EXPECT_NEAR(patch.axis_u.cross(patch.axis_v).z(), 1, 1e-12);
  // The quintic's error for a circle is h^4 / (120 R^5) and smaller terms: under 1 %.
  EXPECT_NEAR(patch.curvature_per_m(0, 0), 1 / bend, 0.01 / bend);
  EXPECT_NEAR(patch.curvature_per_m(1, 1), 0, 1e-9);
  EXPECT_NEAR(patch.curvature_per_m(0, 1), 0, 1e-9);
  const MarksOnSurface alone{*marks.find({0, 0})};
  const SurfacePatch lonely = surface_patch(alone, {0, 0}, pitch, Vector3d::UnitZ());
  EXPECT_GT(lonely.curvature_variance({})[0], 30 * 30);
}

}  // namespace
}  // namespace drape::triangulate

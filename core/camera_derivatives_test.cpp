// SPDX-License-Identifier: Apache-2.0
#include "core/camera_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "core/calibration.hpp"
#include "core/units.hpp"
#include "tests/support/bench1_truth.hpp"

namespace drape {
namespace {

using units::mm;

/// The camera with parameter `index` (order and units of parameter_names()) changed by `step`.
Camera moved(Camera camera, int index, double step) {
  const Eigen::Index lens_size = std::holds_alternative<TsaiLens>(camera.model.lens) ? 5 : 9;
  if (auto* lens = std::get_if<TsaiLens>(&camera.model.lens)) {
    double* const values[] = {&lens->focal_m, &lens->kappa1_per_m2, &lens->cx_px, &lens->cy_px,
                              &lens->scale_x};
    const double units[] = {mm, 1 / (mm * mm), 1, 1, 1};
    if (index < lens_size) *values[index] += step * units[index];
  } else {
    auto& brown = std::get<BrownLens>(camera.model.lens);
    double* const values[] = {&brown.fx_px, &brown.fy_px, &brown.cx_px, &brown.cy_px, &brown.k1,
                              &brown.k2,    &brown.p1,    &brown.p2,    &brown.k3};
    if (index < lens_size) *values[index] += step;
  }
  const int pose = index - static_cast<int>(lens_size);
  if (pose >= 0 && pose < 3) {
    const Eigen::AngleAxisd turn(camera.cam_from_world.rotation);
    Eigen::Vector3d w = turn.angle() * turn.axis();
    w[pose] += step;
    camera.cam_from_world.rotation = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
  }
  if (pose >= 3) camera.cam_from_world.translation_m[pose - 3] += step * mm;
  return camera;
}

void expect_derivatives(const Camera& camera) {
  const Eigen::Vector3d point = Eigen::Vector3d(70, -40, 25) * mm;
  const auto derivatives = d_px_d_parameters(camera, point);
  ASSERT_TRUE(derivatives);
  const auto names = parameter_names(camera.model);
  ASSERT_EQ(derivatives->cols(), static_cast<Eigen::Index>(names.size()));
  for (int i = 0; i < derivatives->cols(); ++i) {
    const double step = 1e-5 / std::max(1e-3, derivatives->col(i).norm());
    const auto at = [&](double s) {
      const Camera c = moved(camera, i, s);
      return project(c.model, c.cam_from_world * point)->px;
    };
    const Eigen::Vector2d expected = (at(step) - at(-step)) / (2 * step);
    EXPECT_LT((derivatives->col(i) - expected).norm(), 1e-5 * (1 + expected.norm())) << names[i];
  }
}

TEST(CameraDerivatives, AgreeWithDifferencesForBrownsLens) {
  Camera camera = test::bench1_truth().cameras[1];
  auto& lens = std::get<BrownLens>(camera.model.lens);
  lens.p1 = 1e-3;
  lens.p2 = -2e-3;
  lens.k3 = 0.05;
  expect_derivatives(camera);
}

TEST(CameraDerivatives, AgreeWithDifferencesForTsaisLens) {
  Camera camera = test::bench1_truth().cameras[2];
  camera.model.lens = TsaiLens{10.7 * mm, 1100, 803, 611, 1.0003, 3.45e-6, 3.47e-6};
  expect_derivatives(camera);
}

TEST(DotImage, EqualsTheRenderersCentroidsOfTheFlatTarget) {
  const auto& truth = test::bench1_truth();
  double worst = 0;
  for (const auto& pose : truth.poses) {
    for (std::size_t cam = 0; cam < 3; ++cam) {
      const Camera& camera = truth.cameras[cam];
      const CamFromTarget cam_from_target = camera.cam_from_world * pose.world_from_target;
      for (int dot = 0; dot < 108; ++dot) {
        const int row = dot / 12, col = dot % 12;
        const Eigen::Vector3d centre((col * 20 - 110) * mm, (row * 20 - 80) * mm, 0);
        const auto px = dot_centroid_px(camera.model,
                                        {cam_from_target * centre, cam_from_target.rotation.col(0),
                                         cam_from_target.rotation.col(1), 4 * mm});
        ASSERT_TRUE(px);
        worst = std::max(worst, (*px - pose.centroid_px[cam][dot]).norm());
      }
    }
  }
  EXPECT_LT(worst, 1e-3);  // the truth has four decimals and polygonal outlines
}

TEST(DotImage, OnACylinderLiesUnderTheSurfaceByThreeEighthsOfRadiusSquaredOverR) {
  // Distant camera, so that only curvature matters; tilted across the axis of the cylinder.
  const double radius = 1.5 * mm, bend = 20 * mm, tilt = 0.7;
  const CameraModel model{BrownLens{1e6, 1e6, 0, 0}, 1600, 1200};
  const Eigen::Vector3d u(std::cos(tilt), 0, std::sin(tilt)), v(0, -1, 0);
  const Eigen::Vector3d normal = u.cross(v);
  Eigen::Matrix2d curvature = Eigen::Matrix2d::Zero();
  curvature(0, 0) = 1 / bend;
  const Eigen::Vector3d centre(0, 0, 1000);
  const auto px = dot_centroid_px(model, {centre, u, v, radius, curvature});
  const Eigen::Vector3d under = centre - 3 * radius * radius / (8 * bend) * normal;
  ASSERT_TRUE(px);
  const double expected = project(model, under)->px.x();
  EXPECT_NEAR(px->x(), expected, 0.01 * std::abs(expected));
}

}  // namespace
}  // namespace drape

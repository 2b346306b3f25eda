// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include "core/calibration.hpp"
#include "core/geometry/closed_mesh.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/vectors.hpp"
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

// ----
// Known answers of the geometry used by several stages.

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

class Geometry : public testing::Test {
 protected:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Vector3d vector(double size) {
    return {number(-size, size), number(-size, size), number(-size, size)};
  }

 private:
  std::mt19937 random_{3};
};

TEST_F(Geometry, RotationVectorsAndCrossProducts) {
  const Vector3d v = vector(2), w = vector(2);
  EXPECT_LT((cross_matrix(v) * w - v.cross(w)).norm(), 1e-15);
  EXPECT_LT((rotation_vector(rotation_about(v)) - v).norm(), 1e-14);
  EXPECT_EQ(rotation_about(Vector3d::Zero()), Matrix3d::Identity());
  EXPECT_NEAR(signed_area(std::vector<Vector2d>{{0, 0}, {2, 0}, {2, 3}}), 3, 1e-15);
  EXPECT_NEAR(signed_area(std::vector<Vector2d>{{2, 3}, {2, 0}, {0, 0}}), -3, 1e-15);
}

TEST_F(Geometry, RigidMotionTakesPointsBackAndRefusesALine) {
  for (const int count : {3, 4, 50}) {
    Eigen::Matrix3Xd from(3, count);
    for (int i = 0; i < count; ++i) from.col(i) = vector(1);
    const Matrix3d turn = rotation_about(vector(3));
    const Vector3d shift = vector(5);
    const auto found = rigid_motion(from, (turn * from).colwise() + shift);
    ASSERT_TRUE(found);
    EXPECT_LT((found->rotation - turn).norm(), 1e-12);
    EXPECT_LT((found->translation_m - shift).norm(), 1e-12);
    EXPECT_LT((nearest_rotation(1.3 * turn) - turn).norm(), 1e-12);
    // A mirror image is fitted by the best rotation and remains a mirror image.
    const auto mirrored = rigid_motion(from, Vector3d(1, 1, -1).asDiagonal() * from);
    ASSERT_TRUE(mirrored);
    EXPECT_NEAR(mirrored->rotation.determinant(), 1, 1e-12);
  }
  Eigen::Matrix3Xd line(3, 4);
  for (int i = 0; i < 4; ++i) line.col(i) = i * Vector3d(1, 2, 3);
  EXPECT_FALSE(rigid_motion(line, line));
  EXPECT_FALSE(rigid_motion(line.leftCols(2), line.leftCols(2)));
}

TEST_F(Geometry, HomographyTakesPointsToTheirImages) {
  Matrix3d map;
  map << 800, 30, 500, -20, 900, 400, 0.3, 0.2, 1;
  std::vector<Vector2d> from, to;
  for (int i = 0; i < 12; ++i) {
    from.emplace_back(number(-0.2, 0.2), number(-0.2, 0.2));
    to.emplace_back((map * from.back().homogeneous()).hnormalized());
  }
  const auto found = homography(from, to);
  ASSERT_TRUE(found);
  EXPECT_LT((*found / (*found)(2, 2) - map).norm() / map.norm(), 1e-9);
  for (Vector2d& point : from) point.y() = 2 * point.x();
  EXPECT_FALSE(homography(from, to)) << "points on a line";
}

TEST_F(Geometry, NearestPointToRaysNeedsTwoThatAreApart) {
  const Vector3d point(0.1, -0.2, 0.3);
  std::vector<Ray> rays;
  for (int i = 0; i < 3; ++i) {
    const Vector3d origin = vector(2);
    rays.push_back({origin, (point - origin).normalized()});
  }
  EXPECT_LT((*nearest_to_rays(rays, 0.01) - point).norm(), 1e-12);
  EXPECT_FALSE(nearest_to_rays({rays[0]}));
  EXPECT_FALSE(nearest_to_rays({rays[0], rays[0]}, 0.01));
}

TEST_F(Geometry, TreeFindsWhatTryingEveryTriangleFinds) {
  std::vector<TriangleTree::Corners> triangles;
  for (int i = 0; i < 300; ++i) {
    const Vector3d at = vector(1);
    triangles.push_back({at, at + vector(0.2), at + vector(0.2)});
  }
  triangles.push_back({Vector3d::Zero(), Vector3d::Zero(), Vector3d::Ones()});  // degenerate
  const TriangleTree tree(triangles);
  for (int i = 0; i < 500; ++i) {
    const Vector3d point = vector(1.5);
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [a, b, c] : triangles)
      least = std::min(least, (nearest_on_triangle(point, a, b, c).point - point).squaredNorm());
    const TriangleTree::Nearest found = tree.nearest(point);
    EXPECT_EQ(found.squared, least);
    EXPECT_NEAR((found.point - point).squaredNorm(), least, 1e-15);
  }
}

TEST(ClosedMesh, RefusesWhatIsNotClosed) {
  const std::vector<Vector3d> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<ClosedMesh::Triangle> faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const ClosedMesh mesh(corners, faces, "tetrahedron");
  EXPECT_NEAR(mesh.distance({0.1, 0.1, -0.5}).gap_m, 0.5, 1e-15);
  EXPECT_NEAR(mesh.distance({0.1, 0.2, 0.3}).gap_m, -0.1, 1e-15);
  EXPECT_THROW(ClosedMesh(corners, {faces[0], faces[1], faces[2]}, "open"), Error);
  EXPECT_THROW(ClosedMesh(corners, {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}, "inside out"),
               Error);
}

}  // namespace
}  // namespace drape

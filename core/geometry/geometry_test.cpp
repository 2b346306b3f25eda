// SPDX-License-Identifier: Apache-2.0
// Known answers of the geometry used by several stages.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>

#include "core/error.hpp"
#include "core/geometry/closed_mesh.hpp"
#include "core/geometry/point.hpp"
#include "core/geometry/rigid_motion.hpp"
#include "core/geometry/vectors.hpp"

namespace drape {
namespace {

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

// SPDX-License-Identifier: Apache-2.0

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/files/files.hpp"
#include "simulate/objects/surroundings.hpp"
#include "tests/support/paths.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

/// A cube of 20 mm around the origin, with quads as faces.
const char* const kCube =
    "v -10 -10 -10\nv 10 -10 -10\nv 10 10 -10\nv -10 10 -10\n"
    "v -10 -10 10\nv 10 -10 10\nv 10 10 10\nv -10 10 10\n"
    "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

TEST(TriangleMesh, CubeHasTheDistancesOfABox) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "cube.obj", kCube);
  Surroundings shapes;
  shapes.add(MeshObject{folder.path() / "cube.obj", {}});
  shapes.add(Box{{}, {0.02, 0.02, 0.02}, 0});
  for (int k = 0; k < 2000; ++k) {
    const Vector3d p(0.02 * std::sin(1.1 * k), 0.02 * std::sin(2.3 * k + 1),
                     0.02 * std::sin(0.7 * k + 2));
    EXPECT_NEAR(shapes.gap_m(0, p), shapes.gap_m(1, p), 1e-12);
    if (shapes.gap_m(1, p) > 1e-6) {
      EXPECT_LT((shapes.normal(0, p) - shapes.normal(1, p)).norm(), 1e-9);
    }
  }
  EXPECT_NEAR(shapes.top_z_m(), 0.01, 1e-15);
}

TEST(TriangleMesh, OneThatReachesBelowTheTableIsAskedWhichAxisIsUp) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "cube.obj", kCube);
  Scene scene;
  scene.table_z_m = -0.01;
  scene.obstacles = {MeshObject{folder.path() / "cube.obj", {}}};
  EXPECT_TRUE(faults_of(scene).empty());
  scene.table_z_m = -0.0075;  // 2.5 mm; three uncertainties of two steel rules are 2.1 mm
  ASSERT_EQ(faults_of(scene).size(), 1U);
  EXPECT_NE(std::string(faults_of(scene).front().what()).find("is the mesh y up?"),
            std::string::npos);
}

/// A residual of 1e-6 weights is a particle's displacement of 2e-13 m there.
TEST(TriangleMesh, DistanceIsLinearThroughAFace) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "cube.obj", kCube);
  Surroundings shapes;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  shapes.add(MeshObject{folder.path() / "cube.obj", {turn, Vector3d::Zero()}});
  const Vector3d normal = turn * Vector3d::UnitX();
  for (const double height_m : {-1e-9, -1e-13, -1e-15, 0.0, 1e-15, 1e-13, 1e-12, 1e-9}) {
    const Vector3d p = turn * Vector3d(0.01, 0.003, -0.004) + height_m * normal;
    EXPECT_NEAR(shapes.gap_m(0, p), height_m, 1e-17);
    EXPECT_LT((shapes.normal(0, p) - normal).norm(), 1e-15);
  }
}

TEST(TriangleMesh, OpenAndInvertedMeshesAreRefused) {
  const test::TemporaryFolder folder;
  const std::string cube = kCube;
  write_durable(folder.path() / "open.obj", cube.substr(0, cube.find("f 4 1 5 8")));
  EXPECT_THROW((void)ClosedMesh::read(folder.path() / "open.obj"), Error);
  write_durable(folder.path() / "lost.obj", cube + "f 1 2 99\n");
  EXPECT_THROW((void)ClosedMesh::read(folder.path() / "lost.obj"), Error);
  write_durable(folder.path() / "cube.stl", cube);
  EXPECT_THROW((void)ClosedMesh::read(folder.path() / "cube.stl"), Error);
}

TEST(TriangleMesh, AMeshInAnotherUnitIsRefusedWithTheLikelyOne) {
  const test::TemporaryFolder folder;
  const auto box = [&](double side) {
    std::string text;
    for (int corner = 0; corner < 8; ++corner)
      text += fmt::format("v {} {} {}\n", side * (corner & 1), side * (corner >> 1 & 1),
                          side * (corner >> 2));
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    write_durable(folder.path() / "box.obj", text);
    return folder.path() / "box.obj";
  };
  for (const double side_mm : {5.0, 128.0, 3000.0})
    EXPECT_NEAR(ClosedMesh::read(box(side_mm)).corners().back().z(), side_mm * 1e-3, 1e-12);
  for (const auto& [side, unit] : {std::pair{0.128, "are these m,"},
                                   {1.8, "are these m,"},
                                   {4.9, "are these inches?"},
                                   {128e3, "are these um?"},
                                   {1e-9, "check its size"}}) {
    try {
      (void)ClosedMesh::read(box(side));
      ADD_FAILURE() << "taken: " << side;
    } catch (const Error& error) {
      EXPECT_EQ(error.where().file, (folder.path() / "box.obj").string());
      EXPECT_NE(error.what_to_do().find(unit), std::string::npos) << error.what_to_do();
    }
  }
}

TEST(TriangleMesh, AsciiPlyIsRead) {
  const test::TemporaryFolder folder;
  write_durable(folder.path() / "tetra.ply",
                "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                "property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
                "end_header\n0 0 0\n10 0 0\n0 10 0\n0 0 10\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const ClosedMesh mesh = ClosedMesh::read(folder.path() / "tetra.ply");
  EXPECT_EQ(mesh.triangles().size(), 4U);
  EXPECT_NEAR(mesh.distance({0.001, 0.002, -0.003}).gap_m, 0.003, 1e-12);
  EXPECT_NEAR(mesh.distance({0.001, 0.002, 0.0005}).gap_m, -0.0005, 1e-12);
}

TEST(Cylinder, DistancesAreExact) {
  Surroundings shapes;
  shapes.add(drape::Cylinder{{}, 0.02, 0.1, 0.005});
  EXPECT_NEAR(shapes.gap_m(0, {0.03, 0, 0}), 0.01, 1e-15);
  EXPECT_NEAR(shapes.gap_m(0, {0, 0, 0.06}), 0.01, 1e-15);
  EXPECT_NEAR(shapes.gap_m(0, {0.02, 0, 0.05}), 0.005 * (std::sqrt(2.0) - 1), 1e-15);
  EXPECT_LT((shapes.normal(0, {0, -0.03, 0}) - Vector3d(0, -1, 0)).norm(), 1e-15);
  EXPECT_NEAR(shapes.top_z_m(), 0.05, 1e-15);
}

/// Gap, normal and curvature are derivatives of each other, at faces, edges, corners and borders.
TEST(Surroundings, NormalAndCurvatureAreTheDerivativesOfTheGap) {
  Surroundings shapes;
  const WorldFromObject turned{
      Eigen::AngleAxisd(0.6, Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
      Vector3d(0.003, 0, 0.001)};
  shapes.add(drape::Sphere{{0.001, 0, 0}, 0.02});
  shapes.add(Box{turned, {0.03, 0.02, 0.04}, 0.005});
  shapes.add(drape::Cylinder{turned, 0.02, 0.03, 0.005});
  shapes.add(drape::Plane{Vector3d::Zero(), Vector3d(1, 2, 3).normalized()});
  constexpr double kStep = 1e-7;
  int on_faces = 0, looked_at = 0;
  for (int shape = 0; shape < shapes.count(); ++shape)
    for (int k = 0; k < 300; ++k) {
      Vector3d p(0.02 * std::sin(1.1 * k), 0.02 * std::sin(2.3 * k + 1),
                 0.02 * std::sin(0.7 * k + 2));
      for (int pull = 0; pull < 3; ++pull) {
        const Surroundings::Nearest nearest = shapes.nearest(shape, p);
        p += (1e-4 - nearest.gap_m) * nearest.normal;
      }
      if (shapes.gap_m(shape, p) < 0) continue;
      ++looked_at;
      const Surroundings::Nearest here = shapes.nearest(shape, p);
      EXPECT_NEAR(here.gap_m, shapes.gap_m(shape, p), 1e-15);
      on_faces += here.face >= 0 ? 1 : 0;
      const Eigen::Matrix3d curvature = shapes.curvature(shape, p);
      EXPECT_TRUE(here.face < 0 || curvature.norm() < 1e-12);
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d step = kStep * Vector3d::Unit(axis);
        EXPECT_NEAR((shapes.gap_m(shape, p + step) - shapes.gap_m(shape, p - step)) / (2 * kStep),
                    here.normal[axis], 1e-6);
        const Vector3d turn = shapes.normal(shape, p + step) - shapes.normal(shape, p - step);
        EXPECT_LT((turn / (2 * kStep) - curvature.col(axis)).norm(), 1e-3) << shape << " " << k;
      }
    }
  EXPECT_GT(on_faces, 300);
  EXPECT_GT(looked_at - on_faces, 300);
}

/// Expects slope, normal and, outside, curvature to be derivatives of a shape's gap at a point.
void expect_derivatives(const Surroundings& closed, int shape, const Vector3d& p) {
  constexpr double kStep = 1e-7;
  const Surroundings::Nearest here = closed.nearest(shape, p);
  EXPECT_EQ(here.gap_m, closed.gap_m(shape, p));
  if (here.slope < 0.05) return;  // about its axis
  const Eigen::Matrix3d curvature = closed.curvature(shape, p);
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep * Vector3d::Unit(axis);
    const Surroundings::Nearest before = closed.nearest(shape, p - step),
                                after = closed.nearest(shape, p + step);
    // Kinks, where another face, edge or body is nearest.
    if ((after.normal - before.normal).norm() > 1e-3) continue;
    EXPECT_NEAR((after.gap_m - before.gap_m) / (2 * kStep), here.slope * here.normal[axis], 1e-5);
    const Vector3d turn = after.slope * after.normal - before.slope * before.normal;
    if (here.gap_m > 0) {
      EXPECT_LT((turn / (2 * kStep) - here.slope * curvature.col(axis)).norm(), 2e-2) << shape;
    }
  }
}

/// Bodies of which all but the last stand on a floor at height 0.1.
Scene standing_scene() {
  Scene scene;
  scene.table_z_m = 0.1;
  scene.obstacles = {drape::Sphere{{0, 0, 0.13}, 0.03}, drape::Cylinder{{}, 0.02, 0.03, 0.002},
                     Box{{}, {0.03, 0.02, 0.04}, 0.005}, Box{{}, {0.03, 0.02, 0.04}, 0},
                     drape::Sphere{{0, 0, 0.1306}, 0.03}};
  auto& lies = std::get<drape::Cylinder>(scene.obstacles[1]).world_from_cylinder;
  lies.rotation = Eigen::AngleAxisd(1.57079632679489662, Vector3d::UnitX()).toRotationMatrix();
  lies.translation_m.z() = 0.12;
  for (const int box : {2, 3})
    std::get<Box>(scene.obstacles[box]).world_from_box.translation_m.z() = 0.12;
  return scene;
}

// Below half a millimetre above the table an object is as wide as there; slope, normal and
// curvature are derivatives of its gap.
TEST(Surroundings, ClosesThinGapsOnTheTable) {
  for (int shape = 0; shape < 5; ++shape) {
    Scene scene = standing_scene();
    scene.obstacles = {scene.obstacles[shape]};
    const Surroundings open(scene), closed(scene, kClosed_m);
    int entered = 0;
    for (int k = 0; k < 400; ++k) {
      const Vector3d p(0.02 * std::sin(1.1 * k), 0.02 * std::sin(2.3 * k + 1),
                       0.1001 + 0.0003 * std::sin(0.7 * k + 2));
      const Vector3d above(p.x(), p.y(), 0.1 + kClosed_m);
      EXPECT_EQ(closed.gap_m(0, p), std::min(open.gap_m(0, p), open.gap_m(0, above)));
      const Vector3d higher = p + Vector3d(0, 0, 0.0008);
      EXPECT_EQ(closed.gap_m(0, higher), open.gap_m(0, higher));
      if (closed.gap_m(0, p) < 0 && open.gap_m(0, p) > 0) ++entered;
      expect_derivatives(closed, 0, p);
    }
    EXPECT_EQ(entered > 0, shape < 4) << shape;
  }
}

// A tilted plane closes gaps as the table does: the scene turned as a whole has the same distances.
TEST(Surroundings, ClosesThinGapsOnATiltedPlane) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.4, Vector3d(1, 2, 0).normalized()).toRotationMatrix();
  Scene upright;
  upright.table_z_m = 0.1;
  upright.obstacles = {drape::Sphere{{0, 0, 0.13}, 0.03}};
  Scene tilted;
  tilted.table_z_m = -1;
  tilted.obstacles = {drape::Sphere{turn * Vector3d(0, 0, 0.13), 0.03},
                      Plane{turn * Vector3d(0.3, 0, 0.1), turn * Vector3d::UnitZ()}};
  const Surroundings on_table(upright, kClosed_m), on_plane(tilted, kClosed_m);
  for (int k = 0; k < 400; ++k) {
    const Vector3d p(0.02 * std::sin(1.1 * k), 0.02 * std::sin(2.3 * k + 1),
                     0.1003 + 0.0005 * std::sin(0.7 * k + 2));
    EXPECT_NEAR(on_plane.gap_m(0, turn * p), on_table.gap_m(0, p), 1e-15);
    expect_derivatives(on_plane, 0, turn * p);
  }
}

// Where two bodies are closer than half a millimetre, nothing lies between them. Elsewhere each
// keeps its distance, and no gap changes faster than a point moves.
TEST(Surroundings, ClosesThinGapsBetweenBodies) {
  const drape::Sphere ball{{0, 0, 0.03}, 0.03};
  drape::Cylinder log{{}, 0.02, 0.1, 0.002};
  log.world_from_cylinder.translation_m = {-0.0501, 0, 0.03};
  const Box beside{{Eigen::Matrix3d::Identity(), {0.05, 0, 0.03}}, {0.04, 0.05, 0.06}, 0.001};
  const Box slab{{Eigen::Matrix3d::Identity(), {0, 0, -0.01}}, {0.2, 0.2, 0.02}, 0};
  Scene scene;
  scene.table_z_m = -1;
  for (const Obstacle& other : {Obstacle(log), Obstacle(beside), Obstacle(slab)}) {
    scene.obstacles = {other, ball};
    const Surroundings open(scene), closed(scene, kClosed_m);
    int entered = 0;
    Vector3d last = Vector3d::Zero();
    for (int k = 0; k < 4000; ++k) {
      const Vector3d away(std::sin(1.1 * k), std::sin(2.3 * k + 1), std::sin(0.7 * k + 2));
      // About the place where the ball touches the other one.
      const double side = open.gap_m(0, {0.03, 0, 0.03}) < 1e-3    ? 0.03
                          : open.gap_m(0, {-0.03, 0, 0.03}) < 1e-3 ? -0.03
                                                                   : 0;
      const Vector3d p = Vector3d(side, 0, side == 0 ? 0 : 0.03) + 0.006 * away;
      const double own = open.gap_m(1, p), others = open.gap_m(0, p);
      EXPECT_EQ(closed.gap_m(0, p), others);
      const double sum = own + others - kClosed_m;
      EXPECT_EQ(closed.gap_m(1, p), std::min(own, sum > 0 ? sum / 2 : sum));
      const double here = closed.gap_m(1, p), there = closed.gap_m(1, last);
      EXPECT_LE(std::abs(std::max(here, 0.0) - std::max(there, 0.0)), (p - last).norm() + 1e-15);
      if (own > 0 && others > 0) {
        EXPECT_EQ(closed.gap_m(1, p) < 0, own + others < kClosed_m);
        entered += own + others < kClosed_m ? 1 : 0;
      }
      expect_derivatives(closed, 1, p);
      last = p;
    }
    EXPECT_GT(entered, 10);
  }
}

}  // namespace
}  // namespace drape::simulate

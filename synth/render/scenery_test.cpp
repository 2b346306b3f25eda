// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/error.hpp"
#include "core/units.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {
namespace {

using Eigen::Vector3d;
using units::mm;

Scene with(const Obstacle& obstacle) {
  Scene scene;
  scene.table_z_m = -50 * mm;
  scene.obstacles = {obstacle};
  return scene;
}

/// Triangles other than the table's.
std::vector<Triangle> object_of(const Obstacle& obstacle) {
  std::vector<Triangle> all = triangles_of(with(obstacle));
  all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(table_triangles(0).size()));
  return all;
}

TEST(Scenery, EachObjectHasItsSurfaceWithNormalsOutwards) {
  const Sphere sphere{Vector3d(10, 20, 30) * mm, 40 * mm};
  for (const Triangle& t : object_of(sphere)) {
    for (int k = 0; k < 3; ++k) {
      const Vector3d out = t.corners_in_world[k] - sphere.centre_in_world;
      EXPECT_NEAR(out.norm(), sphere.radius_m, 1e-12);
      EXPECT_GT(out.dot(t.normals_in_world[k]), 0.039);
    }
  }
  Box box;
  box.size_m = Vector3d(20, 40, 60) * mm;
  for (const Triangle& t : object_of(box)) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR((t.corners_in_world[k].cwiseQuotient(box.size_m)).cwiseAbs().maxCoeff(), 0.5,
                  1e-12);
      EXPECT_GT(t.corners_in_world[k].dot(t.normals_in_world[k]), 0);
    }
  }
}

TEST(Scenery, APlaneIsRenderedAroundItsPoint) {
  const Plane plane{Vector3d(0, 0, 12) * mm, Vector3d(0.6, 0, 0.8)};
  const std::vector<Triangle> all = object_of(plane);
  ASSERT_FALSE(all.empty());
  for (const Triangle& t : all) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR((t.corners_in_world[k] - plane.point_in_world).dot(plane.normal_in_world), 0,
                  1e-12);
    }
  }
}

TEST(Scenery, WhatIsDrawnInLiesWithinTheRoundedSolid) {
  Box box;
  box.size_m = Vector3d(80, 80, 80) * mm;
  box.edge_radius_m = 5 * mm;
  const Scene inner = drawn_in(with(box), 1 * mm);
  EXPECT_NEAR(inner.table_z_m, -51 * mm, 1e-12);
  const Vector3d corner = std::get<Box>(inner.obstacles.front()).size_m / 2;
  // The rounded corner is an eighth of a ball; the drawn corner is 1 mm or more inside it.
  const Vector3d ball = Vector3d::Constant(35 * mm);
  EXPECT_LE((corner - ball).norm(), box.edge_radius_m - 1 * mm);
  const Scene ball_scene = drawn_in(with(Sphere{Vector3d(0, 0, 40) * mm, 40 * mm}), 1 * mm);
  EXPECT_NEAR(std::get<Sphere>(ball_scene.obstacles.front()).radius_m, 39 * mm, 1e-12);
}

TEST(Scenery, AMeshIsRefusedByName) {
  try {
    (void)triangles_of(with(MeshObject{"head.obj", {}}));
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("head.obj"));
    EXPECT_THAT(error.what(), testing::HasSubstr("cannot be rendered"));
  }
}

}  // namespace
}  // namespace drape::synth

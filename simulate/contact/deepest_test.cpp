// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/deepest.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSpacing = 5e-3;  // m, of the pieces

Surroundings bodies() {
  Surroundings all;
  Box box;
  box.size_m = Vector3d(0.08, 0.08, 0.08);
  box.edge_radius_m = 1e-3;
  all.add(box);
  all.add(Sphere{Vector3d::Zero(), 0.045});
  return all;
}

/// Triangles over an edge and a corner of the box and over the sphere, tilted and uneven.
std::vector<std::pair<int, SheetTriangle>> triangles(int count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  const Vector3d places[3] = {{0.0397, 0, 0.0397}, {0.0394, 0.0394, 0.0394}, {0.026, 0.026, 0.026}};
  std::vector<std::pair<int, SheetTriangle>> all;
  for (int k = 0; k < count; ++k) {
    const int kind = k % 3;
    const auto vary = [&](double most) {
      return Vector3d(most * any(random), most * any(random), most * any(random));
    };
    const Vector3d middle = places[kind] + vary(2e-4);
    const Vector3d out = (kind == 0 ? Vector3d(1, 0, 1) : Vector3d(1, 1, 1)).normalized();
    const Vector3d a = (out.unitOrthogonal() + vary(0.2)).normalized();
    const Vector3d b = (out.cross(a) + vary(0.2)).normalized();
    const double u[3] = {-0.5, 0.5, 0}, v[3] = {-0.3, -0.3, 0.6};
    SheetTriangle triangle;
    for (int c = 0; c < 3; ++c)
      triangle[c] = middle + kSpacing * (u[c] * a + v[c] * b) + vary(1e-4);
    all.emplace_back(kind == 2 ? 1 : 0, triangle);
  }
  return all;
}

TEST(DeepestPlace, IsWhereADenseSearchFindsIt) {
  const Surroundings all = bodies();
  constexpr int kSamples = 100;
  for (const auto& [shape, triangle] : triangles(120)) {
    double least = 1;
    for (int k = 0; k <= kSamples; ++k) {
      for (int l = 0; k + l <= kSamples; ++l) {
        const double u = k / static_cast<double>(kSamples), v = l / static_cast<double>(kSamples);
        least = std::min(
            least, all.gap_m(shape, (1 - u - v) * triangle[0] + u * triangle[1] + v * triangle[2]));
      }
    }
    const DeepestPlace found = deepest_place(all, shape, triangle);
    EXPECT_GE(found.weights.minCoeff(), 0);
    EXPECT_NEAR(found.weights.sum(), 1, 1e-15);
    // The term added for the place's sake is at most a third of steady_m.
    EXPECT_LT(found.gap_m, least + DeepestPlace::steady_m / 3);
  }
}

TEST(DeepestPlace, HasTheDerivativesOfItsDepth) {
  const Surroundings all = bodies();
  constexpr double kStep = 1e-7;  // m
  int compared = 0;
  for (const auto& [shape, triangle] : triangles(60)) {
    const DeepestPlace here = deepest_place(all, shape, triangle);
    const DepthCurvature curvature = depth_curvature(all, shape, triangle, here);
    const Eigen::Matrix<double, 9, 9> second = -(curvature.bends + curvature.slides);
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        SheetTriangle before = triangle, after = triangle;
        before[k][axis] -= kStep;
        after[k][axis] += kStep;
        const DeepestPlace low = deepest_place(all, shape, before);
        const DeepestPlace high = deepest_place(all, shape, after);
        EXPECT_NEAR((high.depth_m - low.depth_m) / (2 * kStep), here.weights[k] * here.normal[axis],
                    1e-6);
        // At a border the depth has a kink in its slope.
        const bool inner = low.weights.minCoeff() > 1e-3 && high.weights.minCoeff() > 1e-3;
        if (!inner) continue;
        ++compared;
        for (int l = 0; l < 3; ++l) {
          const Vector3d change =
              (high.weights[l] * high.normal - low.weights[l] * low.normal) / (2 * kStep);
          const Vector3d model = second.block<3, 1>(3 * l, 3 * k + axis);
          EXPECT_LT((change - model).norm(), 1e-3 * second.norm());
        }
      }
    }
  }
  EXPECT_GT(compared, 100);
}

TEST(DeepestPlace, IsNotSoughtWhereAConvexBodyShowsOnePlane) {
  const Surroundings all = bodies();
  SheetTriangle triangle{Vector3d(0, 0, 0.0399), Vector3d(0.005, 0.001, 0.0402),
                         Vector3d(0.001, 0.005, 0.04)};
  EXPECT_TRUE(is_seen_flat(all, 0, triangle));
  triangle[1] = Vector3d(0.0405, 0, 0.0402);
  EXPECT_FALSE(is_seen_flat(all, 0, triangle));
  EXPECT_FALSE(is_seen_flat(all, 1, triangle));
}

}  // namespace
}  // namespace drape::simulate

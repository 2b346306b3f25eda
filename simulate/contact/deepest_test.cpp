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

/// Pieces over an edge and a corner of the box and over the sphere, tilted and a little uneven.
std::vector<std::pair<int, SheetPiece>> pieces(int corners, int count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> any(-1, 1);
  const Vector3d places[3] = {{0.0397, 0, 0.0397}, {0.0394, 0.0394, 0.0394}, {0.026, 0.026, 0.026}};
  std::vector<std::pair<int, SheetPiece>> all;
  for (int k = 0; k < count; ++k) {
    const int kind = k % 3;
    const auto vary = [&](double most) {
      return Vector3d(most * any(random), most * any(random), most * any(random));
    };
    const Vector3d middle = places[kind] + vary(2e-4);
    const Vector3d out = (kind == 0 ? Vector3d(1, 0, 1) : Vector3d(1, 1, 1)).normalized();
    const Vector3d a = (out.unitOrthogonal() + vary(0.2)).normalized();
    const Vector3d b = (out.cross(a) + vary(0.2)).normalized();
    SheetPiece piece;
    piece.corners = corners;
    for (int c = 0; c < corners; ++c) {
      const double u = corners == 2 ? c - 0.5 : c / 2 - 0.5, v = corners == 2 ? 0 : c % 2 - 0.5;
      piece.at[c] = middle + kSpacing * (u * a + v * b) + vary(1e-4);
    }
    all.emplace_back(kind == 2 ? 1 : 0, piece);
  }
  return all;
}

Vector3d point_at(const SheetPiece& piece, double u, double v) {
  if (piece.corners == 2) return (1 - u) * piece.at[0] + u * piece.at[1];
  return (1 - u) * ((1 - v) * piece.at[0] + v * piece.at[1]) +
         u * ((1 - v) * piece.at[2] + v * piece.at[3]);
}

TEST(DeepestPlace, IsWhereADenseSearchFindsIt) {
  const Surroundings all = bodies();
  constexpr int kSamples = 100;
  for (const int corners : {2, 4}) {
    for (const auto& [shape, piece] : pieces(corners, 60)) {
      double least = 1;
      for (int k = 0; k <= kSamples; ++k) {
        for (int l = 0; l <= (corners == 2 ? 0 : kSamples); ++l) {
          const double u = k / static_cast<double>(kSamples);
          const double v = l / static_cast<double>(kSamples);
          least = std::min(least, all.gap_m(shape, point_at(piece, u, v)));
        }
      }
      // What is added for the place's sake is at most a quarter of steady_m.
      EXPECT_LT(deepest_place(all, shape, piece).gap_m, least + 0.25 * DeepestPlace::steady_m);
    }
  }
}

TEST(DeepestPlace, HasTheDerivativesOfItsDepth) {
  const Surroundings all = bodies();
  constexpr double kStep = 1e-7;  // m
  for (const int corners : {2, 4}) {
    for (const auto& [shape, piece] : pieces(corners, 30)) {
      const DeepestPlace here = deepest_place(all, shape, piece);
      const DepthCurvature curvature = depth_curvature(all, shape, piece, here);
      const Eigen::Matrix<double, 12, 12> second = -(curvature.bends + curvature.slides);
      for (int k = 0; k < corners; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
          SheetPiece before = piece, after = piece;
          before.at[k][axis] -= kStep;
          after.at[k][axis] += kStep;
          const DeepestPlace low = deepest_place(all, shape, before);
          const DeepestPlace high = deepest_place(all, shape, after);
          // At a border the depth has a kink in its slope.
          if (low.place.cwiseMin(high.place).minCoeff() < 1e-3 ||
              low.place.cwiseMax(high.place).maxCoeff() > 1 - 1e-3)
            continue;
          EXPECT_NEAR((high.depth_m - low.depth_m) / (2 * kStep),
                      here.weight[k] * here.normal[axis], 1e-6);
          for (int l = 0; l < corners; ++l) {
            const Vector3d change =
                (high.weight[l] * high.normal - low.weight[l] * low.normal) / (2 * kStep);
            const Vector3d model = second.block<3, 1>(3 * l, 3 * k + axis);
            EXPECT_LT((change - model).norm(), 1e-3 * second.norm());
          }
        }
      }
    }
  }
}

TEST(DeepestPlace, IsNotSoughtWhereAConvexBodyShowsOnePlane) {
  const Surroundings all = bodies();
  SheetPiece piece;
  piece.corners = 2;
  piece.at[0] = Vector3d(0, 0, 0.0399);
  piece.at[1] = Vector3d(0.005, 0.001, 0.0402);
  EXPECT_TRUE(is_seen_flat(all, 0, piece));
  piece.at[1] = Vector3d(0.0405, 0, 0.0402);
  EXPECT_FALSE(is_seen_flat(all, 0, piece));
  EXPECT_FALSE(is_seen_flat(all, 1, piece));
}

}  // namespace
}  // namespace drape::simulate

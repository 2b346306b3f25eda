// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/self_distance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

const GridSpec kSelfGrid{21, 5, {0.2, 0.04}};

Field shaped(const std::function<Vector3d(double, double)>& place) {
  Field x(3 * static_cast<std::size_t>(kSelfGrid.count()));
  for (int i = 0; i < kSelfGrid.count(); ++i) {
    const int row = i / kSelfGrid.cols, col = i % kSelfGrid.cols;
    const Vector3d p = place(kSelfGrid.warp_spacing_m() * row, kSelfGrid.weft_spacing_m() * col);
    for (int axis = 0; axis < 3; ++axis) x[axis * kSelfGrid.count() + i] = p[axis];
  }
  return x;
}

TEST(SelfDistance, AFlatSheetIsNowhereNearItself) {
  const SelfDistance found =
      self_distance(kSelfGrid, shaped([](double u, double v) { return Vector3d(u, v, 0); }));
  EXPECT_FALSE(found.least_m.has_value());
  EXPECT_EQ(found.crossings, 0);
}

/// A hairpin: half the sheet, a bend, and the other half above it, at an angle in plan so that
/// edges and not particles are nearest.
Field hairpin(double gap_m, double shift_m) {
  return shaped([=](double u, double v) {
    const double half = 0.1;
    if (u < half) return Vector3d(u, v, 0);
    return Vector3d(2 * half - u + shift_m, v + 0.3 * shift_m, gap_m);
  });
}

TEST(SelfDistance, AHairpinIsAsFarFromItselfAsItsGap) {
  for (const double shift : {0.0, 0.0037}) {
    const SelfDistance found = self_distance(kSelfGrid, hairpin(0.003, shift));
    ASSERT_TRUE(found.least_m.has_value());
    EXPECT_NEAR(*found.least_m, 0.003, 1e-12);
    EXPECT_EQ(found.crossings, 0);
  }
}

/// Wavy pleats against each other, each moved a little so that no corners meet.
Field pleats(double gap_m) {
  return shaped([=](double u, double v) {
    const double pleat = 0.02;
    const int k = static_cast<int>(u / pleat);
    const double in = u - k * pleat;
    const double wave = 0.001 * std::sin(300 * u + 90 * v);
    return Vector3d((k % 2 == 0 ? in : pleat - in) + 0.00037 * k, v + 0.0011 * k, gap_m * k + wave);
  });
}

TEST(SelfDistance, IsTheSameHoweverTheSheetIsTurned) {
  for (const Field& sheet :
       {hairpin(0.003, 0.0037), pleats(0.004), pleats(0.0015), pleats(0.0001)}) {
    const SelfDistance still = self_distance(kSelfGrid, sheet);
    ASSERT_TRUE(still.least_m.has_value());
    for (const Vector3d& about :
         {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0.48, 0.6, 0.64)}) {
      const Eigen::AngleAxisd turn(1.234, about);
      Field turned = sheet;
      const int n = kSelfGrid.count();
      for (int i = 0; i < n; ++i) {
        const Vector3d p = turn * Vector3d(sheet[i], sheet[n + i], sheet[2 * n + i]);
        for (int axis = 0; axis < 3; ++axis) turned[axis * n + i] = p[axis];
      }
      const SelfDistance found = self_distance(kSelfGrid, turned);
      EXPECT_EQ(found.crossings, still.crossings);
      EXPECT_EQ(passes_through_itself(kSelfGrid, turned), still.crossings > 0);
      EXPECT_NEAR(found.least_m.value_or(1), *still.least_m, 1e-12);
    }
  }
}

/// The grid's triangles as any others, which count as neighbours by their middles and not by their
/// cells: of layers that are farther apart along the sheet both say the same.
TEST(SelfDistance, OfTrianglesIsThatOfTheGrid) {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Eigen::Vector2d> material;
  const int s = kSelfGrid.cols;
  for (int i = 0; i < kSelfGrid.count(); ++i) {
    const int row = i / s, col = i % s;
    material.emplace_back(kSelfGrid.warp_spacing_m() * row, kSelfGrid.weft_spacing_m() * col);
    if (!kSelfGrid.has_cell(row, col)) continue;
    triangles.push_back({i, i + 1, i + s});
    triangles.push_back({i + 1, i + s + 1, i + s});
  }
  for (const Field& sheet : {hairpin(0.003, 0), hairpin(0.003, 0.0037), pleats(0.0001)}) {
    const SelfDistance grid = self_distance(kSelfGrid, sheet);
    const SelfDistance any = self_distance(triangles, material, kSelfGrid.warp_spacing_m(), sheet);
    EXPECT_EQ(any.crossings, grid.crossings);
    EXPECT_EQ(passes_through_itself(triangles, sheet), grid.crossings > 0);
    ASSERT_TRUE(any.least_m.has_value());
    EXPECT_NEAR(*any.least_m, *grid.least_m, 1e-15);
  }
}

/// The flat sheet, its twelfth row standing up and a particle of the tenth drawn `rows` along it.
SelfDistance drawn(double rows) {
  Field x = shaped([](double u, double v) { return Vector3d(u, v, 0); });
  const int n = kSelfGrid.count(), middle = 10 * kSelfGrid.cols + 2;
  for (int c = 0; c < kSelfGrid.cols; ++c) x[2 * n + 12 * kSelfGrid.cols + c] = 0.008;
  x[middle] += rows * kSelfGrid.warp_spacing_m();
  x[2 * n + middle] = 0.004;
  return self_distance(kSelfGrid, x);
}

TEST(SelfDistance, ASheetThroughItsNeighboursIsSeen) {
  EXPECT_EQ(drawn(0).crossings, 0);
  EXPECT_GT(drawn(1.7).crossings, 0) << "through the next cell";
  EXPECT_GT(drawn(2.7).crossings, 0) << "through the next but one";
}

TEST(SelfDistance, ASheetThroughItselfIsSeen) {
  // A loop whose end dives through its beginning.
  const Field loop = shaped([](double u, double v) {
    if (u < 0.1) return Vector3d(u, v, 0);
    return Vector3d(0.2 - u + 0.0031, v, 0.1521 - u);
  });
  const SelfDistance found = self_distance(kSelfGrid, loop);
  EXPECT_GT(found.crossings, 0);
  EXPECT_EQ(found.least_m.value_or(1), 0);
  EXPECT_TRUE(passes_through_itself(kSelfGrid, loop));
}

}  // namespace
}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/self_distance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

/// A sheet of 200 x 40 mm in cells of 10 mm, two triangles each.
constexpr int kRows = 21, kCols = 5;
constexpr double kStep = 0.01;  // m

struct SheetMesh {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Eigen::Vector2d> material;

  SheetMesh() {
    for (int i = 0; i < kRows * kCols; ++i) {
      const int row = i / kCols, col = i % kCols;
      material.emplace_back(kStep * row, kStep * col);
      if (row + 1 == kRows || col + 1 == kCols) continue;
      triangles.push_back({i, i + 1, i + kCols});
      triangles.push_back({i + 1, i + kCols + 1, i + kCols});
    }
  }
  template <class Map>
  [[nodiscard]] Points shaped(const Map& map) const {
    Points places;
    for (const Eigen::Vector2d& m : material) places.push_back(map(m.x(), m.y()));
    return places;
  }
  [[nodiscard]] SelfDistance distance(const Points& places) const {
    const SelfDistance found = self_distance(triangles, material, kStep, places);
    EXPECT_EQ(passes_through_itself(triangles, places), found.crossings > 0);
    return found;
  }
};
const SheetMesh kSheet;

Points flat() {
  return kSheet.shaped([](double u, double v) { return Vector3d(u, v, 0); });
}

/// A hairpin: half the sheet, a bend, and the other half above it, at an angle in plan so that
/// edges and not corners are nearest.
Points hairpin(double gap_m, double shift_m) {
  return kSheet.shaped([=](double u, double v) {
    const double half = 0.1;
    if (u < half) return Vector3d(u, v, 0);
    return Vector3d(2 * half - u + shift_m, v + 0.3 * shift_m, gap_m);
  });
}

/// Wavy pleats against each other, each moved a little so that no corners meet.
Points pleats(double gap_m) {
  return kSheet.shaped([=](double u, double v) {
    const double pleat = 0.02;
    const int k = static_cast<int>(u / pleat);
    const double in = u - k * pleat;
    const double wave = 0.001 * std::sin(300 * u + 90 * v);
    return Vector3d((k % 2 == 0 ? in : pleat - in) + 0.00037 * k, v + 0.0011 * k, gap_m * k + wave);
  });
}

TEST(SelfDistance, AFlatSheetIsNowhereNearItself) {
  const SelfDistance found = kSheet.distance(flat());
  EXPECT_FALSE(found.least_m.has_value());
  EXPECT_EQ(found.crossings, 0);
}

TEST(SelfDistance, AHairpinIsAsFarFromItselfAsItsGap) {
  for (const double shift : {0.0, 0.0037}) {
    const SelfDistance found = kSheet.distance(hairpin(0.003, shift));
    ASSERT_TRUE(found.least_m.has_value());
    EXPECT_NEAR(*found.least_m, 0.003, 1e-12);
    EXPECT_EQ(found.crossings, 0);
  }
}

TEST(SelfDistance, IsTheSameHoweverTheSheetIsTurned) {
  for (const Points& sheet :
       {hairpin(0.003, 0.0037), pleats(0.004), pleats(0.0015), pleats(0.0001)}) {
    const SelfDistance still = kSheet.distance(sheet);
    ASSERT_TRUE(still.least_m.has_value());
    for (const Vector3d& about :
         {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0.48, 0.6, 0.64)}) {
      Points turned = sheet;
      for (Vector3d& p : turned) p = Eigen::AngleAxisd(1.234, about) * p;
      const SelfDistance found = kSheet.distance(turned);
      EXPECT_EQ(found.crossings, still.crossings);
      EXPECT_NEAR(found.least_m.value_or(1), *still.least_m, 1e-12);
    }
  }
}

/// The flat sheet, its twelfth row standing up and a corner of the tenth drawn `rows` along it.
SelfDistance drawn(double rows) {
  Points x = flat();
  for (int c = 0; c < kCols; ++c) x[12 * kCols + c].z() = 0.008;
  x[10 * kCols + 2] += Vector3d(rows * kStep, 0, 0.004);
  return kSheet.distance(x);
}

TEST(SelfDistance, ASheetThroughItsNeighboursIsSeen) {
  EXPECT_EQ(drawn(0).crossings, 0);
  EXPECT_GT(drawn(1.7).crossings, 0) << "through the next cell";
  EXPECT_GT(drawn(2.7).crossings, 0) << "through the next but one";
}

TEST(SelfDistance, ASheetThroughItselfIsSeen) {
  // A loop whose end dives through its beginning.
  const SelfDistance found = kSheet.distance(kSheet.shaped([](double u, double v) {
    if (u < 0.1) return Vector3d(u, v, 0);
    return Vector3d(0.2 - u + 0.0031, v, 0.1521 - u);
  }));
  EXPECT_GT(found.crossings, 0);
  EXPECT_EQ(found.least_m.value_or(1), 0);
}

}  // namespace
}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/self_distance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace drape::sim {
namespace {

using Eigen::Vector3d;

const GridSpec kGrid{21, 5, {0.2, 0.04}};

Field shaped(const std::function<Vector3d(double, double)>& place) {
  Field x(3 * static_cast<std::size_t>(kGrid.count()));
  for (int i = 0; i < kGrid.count(); ++i) {
    const Vector3d p =
        place(kGrid.warp_spacing_m() * (i / kGrid.cols), kGrid.weft_spacing_m() * (i % kGrid.cols));
    for (int axis = 0; axis < 3; ++axis) x[axis * kGrid.count() + i] = p[axis];
  }
  return x;
}

TEST(SelfDistance, AFlatSheetIsNowhereNearItself) {
  const SelfDistance found =
      self_distance(kGrid, shaped([](double u, double v) { return Vector3d(u, v, 0); }));
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
    const SelfDistance found = self_distance(kGrid, hairpin(0.003, shift));
    ASSERT_TRUE(found.least_m.has_value());
    EXPECT_NEAR(*found.least_m, 0.003, 1e-12);
    EXPECT_EQ(found.crossings, 0);
  }
}

TEST(SelfDistance, ASheetThroughItselfIsSeen) {
  // A loop whose end dives through its beginning.
  const SelfDistance found = self_distance(kGrid, shaped([](double u, double v) {
                                             if (u < 0.1) return Vector3d(u, v, 0);
                                             return Vector3d(0.2 - u + 0.0031, v, 0.1521 - u);
                                           }));
  EXPECT_GT(found.crossings, 0);
  EXPECT_EQ(found.least_m.value_or(1), 0);
}

}  // namespace
}  // namespace drape::sim

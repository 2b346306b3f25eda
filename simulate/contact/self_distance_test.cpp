// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/layer_pair.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using Corners = std::vector<Vector3d>;

/// A sheet of 200 x 40 mm in cells of 10 mm, two triangles each.
constexpr int kFacetRows = 21, kFacetCols = 5;
constexpr double kFacetStep = 0.01;  // m

struct FacetSheet {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Eigen::Vector2d> material;

  FacetSheet() {
    for (int i = 0; i < kFacetRows * kFacetCols; ++i) {
      const int row = i / kFacetCols, col = i % kFacetCols;
      material.emplace_back(kFacetStep * row, kFacetStep * col);
      if (row + 1 == kFacetRows || col + 1 == kFacetCols) continue;
      triangles.push_back({i, i + 1, i + kFacetCols});
      triangles.push_back({i + 1, i + kFacetCols + 1, i + kFacetCols});
    }
  }
  template <class Map>
  [[nodiscard]] Corners shaped(const Map& map) const {
    Corners places;
    for (const Eigen::Vector2d& m : material) places.push_back(map(m.x(), m.y()));
    return places;
  }
  [[nodiscard]] SelfDistance distance(const Corners& places) const {
    const SelfDistance found = self_distance(triangles, material, kFacetStep, places);
    EXPECT_EQ(passes_through_itself(triangles, places), found.crossings > 0);
    return found;
  }
};
const FacetSheet kFacetSheet;

Corners flat_facets() {
  return kFacetSheet.shaped([](double u, double v) { return Vector3d(u, v, 0); });
}

/// A hairpin: half of the sheet, a bend, and the other half above it, rotated in plan so that edges
/// and not corners are nearest.
Corners hairpin(double gap_m, double shift_m) {
  return kFacetSheet.shaped([=](double u, double v) {
    const double half = 0.1;
    if (u < half) return Vector3d(u, v, 0);
    return Vector3d(2 * half - u + shift_m, v + 0.3 * shift_m, gap_m);
  });
}

/// Wavy pleats next to each other, each shifted slightly so that no corners meet.
Corners pleats(double gap_m) {
  return kFacetSheet.shaped([=](double u, double v) {
    const double pleat = 0.02;
    const int k = static_cast<int>(u / pleat);
    const double in = u - k * pleat;
    const double wave = 0.001 * std::sin(300 * u + 90 * v);
    return Vector3d((k % 2 == 0 ? in : pleat - in) + 0.00037 * k, v + 0.0011 * k, gap_m * k + wave);
  });
}

TEST(SelfDistance, AFlatSheetIsNowhereNearItself) {
  const SelfDistance found = kFacetSheet.distance(flat_facets());
  EXPECT_FALSE(found.least_m.has_value());
  EXPECT_EQ(found.crossings, 0);
}

TEST(SelfDistance, AHairpinIsAsFarFromItselfAsItsGap) {
  for (const double shift : {0.0, 0.0037}) {
    const SelfDistance found = kFacetSheet.distance(hairpin(0.003, shift));
    ASSERT_TRUE(found.least_m.has_value());
    EXPECT_NEAR(*found.least_m, 0.003, 1e-12);
    EXPECT_EQ(found.crossings, 0);
  }
}

TEST(SelfDistance, IsTheSameHoweverTheSheetIsTurned) {
  for (const Corners& sheet :
       {hairpin(0.003, 0.0037), pleats(0.004), pleats(0.0015), pleats(0.0001)}) {
    const SelfDistance still = kFacetSheet.distance(sheet);
    ASSERT_TRUE(still.least_m.has_value());
    for (const Vector3d& about :
         {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0.48, 0.6, 0.64)}) {
      Corners turned = sheet;
      for (Vector3d& p : turned) p = Eigen::AngleAxisd(1.234, about) * p;
      const SelfDistance found = kFacetSheet.distance(turned);
      EXPECT_EQ(found.crossings, still.crossings);
      EXPECT_NEAR(found.least_m.value_or(1), *still.least_m, 1e-12);
    }
  }
}

/// The flat sheet with its twelfth row upright and a corner of the tenth moved `rows` along it.
SelfDistance drawn(double rows) {
  Corners x = flat_facets();
  for (int c = 0; c < kFacetCols; ++c) x[12 * kFacetCols + c].z() = 0.008;
  x[10 * kFacetCols + 2] += Vector3d(rows * kFacetStep, 0, 0.004);
  return kFacetSheet.distance(x);
}

TEST(SelfDistance, ASheetThroughItsNeighboursIsSeen) {
  EXPECT_EQ(drawn(0).crossings, 0);
  EXPECT_GT(drawn(1.7).crossings, 0) << "through the next cell";
  EXPECT_GT(drawn(2.7).crossings, 0) << "through the next but one";
}

TEST(SelfDistance, ASheetThroughItselfIsSeen) {
  // A loop whose end passes through its beginning.
  const SelfDistance found = kFacetSheet.distance(kFacetSheet.shaped([](double u, double v) {
    if (u < 0.1) return Vector3d(u, v, 0);
    return Vector3d(0.2 - u + 0.0031, v, 0.1521 - u);
  }));
  EXPECT_GT(found.crossings, 0);
  EXPECT_EQ(found.least_m.value_or(1), 0);
}

}  // namespace
}  // namespace drape::simulate

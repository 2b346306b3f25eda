// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/band.hpp"

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;
using units::mm;

const GridSpec kGrid{3, 3, {0.2, 0.2}};

Print print_of() {
  Print print;
  print.rows = print.cols = 3;
  print.pitch_m = 0.1;
  print.patch_m = {0.2, 0.2};
  print.margin_m = {0, 0};
  return print;
}

/// Flat, raised by `z_m`.
Field flat(double z_m) {
  Field x(27);
  for (int i = 0; i < 9; ++i) put_at(x, i, Vector3d(0.1 * int{i / 3}, 0.1 * (i % 3), z_m));
  return x;
}

/// 41 members, `k` - 20 mm high; the middle one is the only branch, linked by 2 mm.
Branches spread_by_a_millimetre() {
  Branches branches;
  for (int k = 0; k < 41; ++k) branches.members.push_back(flat((k - 20) * mm));
  Branch branch;
  branch.position = flat(0);
  branch.starts = {20};
  branches.linked_m = 2 * mm;
  branches.found.push_back(branch);
  return branches;
}

Sheet measured_at(double z_m) {
  Sheet sheet;
  sheet.rows = sheet.cols = 3;
  sheet.patch_m = {0.2, 0.2};
  for (int i = 0; i < 9; ++i) {
    SheetMark mark;
    mark.mark = {i / 3, i % 3};
    mark.material_m = {0.1 * int{i / 3}, 0.1 * (i % 3)};
    mark.point_in_world = Vector3d(0.1 * int{i / 3}, 0.1 * (i % 3), z_m);
    sheet.marks.push_back(mark);
  }
  return sheet;
}

TEST(Band, HoldsNineteenOfTwentyMembers) {
  const std::vector<MarkBand> band = band_of(spread_by_a_millimetre(), kGrid, print_of());
  ASSERT_EQ(band.size(), 9U);
  for (const MarkBand& one : band) {
    EXPECT_NEAR(one.mean_in_world.z(), 0, 1e-12);
    EXPECT_NEAR(one.low_m.z() / mm, -19, 1e-9);
    EXPECT_NEAR(one.high_m.z() / mm, 19, 1e-9);
    EXPECT_NEAR(one.radius95_m / mm, 19, 1e-9);  // sorted 0, 1, 1, 2, 2 .. 20, 20: place 38
  }
}

TEST(Band, FewMembersHaveNone) {
  Branches few = spread_by_a_millimetre();
  for (std::size_t k = kLeastMembers - 1; k < few.members.size(); ++k) few.members[k].clear();
  EXPECT_EQ(members_at_rest(few), kLeastMembers - 1);
  EXPECT_TRUE(band_of(few, kGrid, print_of()).empty());
}

TEST(Band, ADrapeIsOnTheBranchThatItWouldBeLinkedWith) {
  const Branches branches = spread_by_a_millimetre();
  const std::vector<MarkBand> band = band_of(branches, kGrid, print_of());
  const auto near = assign(measured_at(1.5 * mm), branches, kGrid, band);
  ASSERT_TRUE(near.has_value());
  EXPECT_TRUE(near->is_on());
  EXPECT_NEAR(near->distance_m / mm, 1.5, 1e-9);
  EXPECT_EQ(near->inside_fraction, 1);
  const auto far = assign(measured_at(25 * mm), branches, kGrid, band);
  ASSERT_TRUE(far.has_value());
  EXPECT_FALSE(far->is_on());
  EXPECT_EQ(far->inside_fraction, 0);
  Json json;
  add_measured(far, {"at rest", 3 * mm}, json);
  EXPECT_TRUE(json["measured"]["branch"].is_null());
  EXPECT_EQ(json["measured"]["nearest_branch"], 1);
  EXPECT_NEAR(json["measured"]["started_there_distance_mm"].get<double>(), 3, 1e-12);
}

TEST(Band, NoBranchNoAssignment) {
  EXPECT_FALSE(assign(measured_at(0), Branches(), kGrid, {}).has_value());
}

}  // namespace
}  // namespace drape::simulate

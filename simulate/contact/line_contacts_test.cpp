// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/line_contacts.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include "simulate/cloth/test_grid.hpp"

namespace drape::simulate {
namespace {

constexpr double kStandardGravity = 9.80665;

ClothLaws woven() {
  return linear_laws(0.138, 2000, 30, 7.7e-6, 5e-6);
}

TEST(LineContacts, OfAStaticSheetAreNowhereOnAFlatFace) {
  const GridSpec grid{9, 9, {0.08, 0.08}};
  const Cloth cloth(grid, woven(), MassRule::area);
  Surroundings box;
  box.add(Box{{Eigen::Matrix3d::Identity(), {0, 0, -0.05}}, {0.07, 0.2, 0.1}, 1e-3});
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int i = 0; i < grid.count(); ++i)
    put_at(x, i, {0.01 * int{i / grid.cols} - 0.04, 0.01 * (i % grid.cols) - 0.04, 0});
  LineContacts contacts(cloth, box, 0.4, kStandardGravity);
  contacts.refresh(x);
  // Rows 0 and 8 lie beyond the faces of x = -35 and 35 mm: places of the first and last cells.
  EXPECT_GT(contacts.count(), 0);
  for (const LineContacts::Point& point : contacts.points()) {
    const auto [first, last] = std::minmax_element(point.particle.begin(), point.particle.end());
    EXPECT_TRUE(*first / grid.cols == 0 || *last / grid.cols == 8) << *first << " " << *last;
  }
}

TEST(LineContacts, AreStifferOnlyWhereTheyPressOnSmoothSurfaces) {
  const GridSpec grid{21, 21, {0.2, 0.2}};
  const Cloth cloth(grid, woven(), MassRule::area);
  const double soft = kStandardGravity / LineContacts::sink_m;
  Surroundings table, sharp, round;
  table.add(Table{0});
  sharp.add(Box{{}, {0.1, 0.1, 0.1}, 0});
  round.add(Sphere{{0, 0, 0}, 0.05});
  const auto frequency2 = [&](const Surroundings& surroundings) {
    return LineContacts(cloth, surroundings, 0.4, kStandardGravity, LineContacts::Shapes::smooth)
        .frequency_squared_per_s2();
  };
  EXPECT_DOUBLE_EQ(frequency2(table), soft);
  EXPECT_DOUBLE_EQ(frequency2(sharp), soft);
  EXPECT_DOUBLE_EQ(frequency2(round), kStandardGravity * grid.count() / LineContacts::sheet_sink_m);
}

}  // namespace
}  // namespace drape::simulate

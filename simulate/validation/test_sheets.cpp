// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_sheets.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

namespace drape::simulate {

Field weight(const Cloth& cloth, const Eigen::Vector3d& gravity) {
  Field load(3 * static_cast<std::size_t>(cloth.count()));
  for (int i = 0; i < cloth.count(); ++i) put_at(load, i, cloth.mass_kg()[i] * gravity);
  return load;
}

std::vector<bool> held_rows(const GridSpec& grid, std::initializer_list<int> rows, bool in_plane) {
  const auto n = static_cast<std::size_t>(grid.count());
  std::vector<bool> held(3 * n, false);
  for (std::size_t i = n; i < 2 * n; ++i) held[i] = in_plane;
  for (const int row : rows)
    for (int c = 0; c < grid.cols; ++c)
      for (std::size_t axis = 0; axis < 3; ++axis) held[axis * n + grid.index(row, c)] = true;
  return held;
}

void expect_relative(const std::string& what, double exact, double found, double goal) {
  fmt::print("{:<66} exact {:.8g}, found {:.8g}\n", what, exact, found);
  EXPECT_LE(std::abs(found - exact), goal * std::abs(exact)) << what << ": " << found;
}

void expect_at_most(const std::string& what, double found, double goal) {
  fmt::print("{:<66} {:.3g}, at most {:g}\n", what, found, goal);
  EXPECT_LE(found, goal) << what;
}

void expect_at_least(const std::string& what, double found, double goal) {
  fmt::print("{:<66} {:.3g}, at least {:g}\n", what, found, goal);
  EXPECT_GE(found, goal) << what;
}

}  // namespace drape::simulate

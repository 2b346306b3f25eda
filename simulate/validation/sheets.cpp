// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/sheets.hpp"

#include <fmt/format.h>

#include <cmath>

namespace drape::simulate {

ClothLaws linear_laws(double density, double tensile, double shear, double bending) {
  ClothLaws laws;
  laws.density_kg_per_m2 = density;
  laws.tensile[0] = laws.tensile[1] = {tensile, {}};
  laws.shear = {shear, {}};
  laws.bending[0] = laws.bending[1] = {bending, {}};
  return laws;
}

Field weight(const Cloth& cloth, const Eigen::Vector3d& gravity) {
  Field load(3 * static_cast<std::size_t>(cloth.count()));
  for (int i = 0; i < cloth.count(); ++i) put_at(load, i, cloth.mass_kg()[i] * gravity);
  return load;
}

std::vector<bool> in_plane_xz(const GridSpec& grid) {
  const auto n = static_cast<std::size_t>(grid.count());
  std::vector<bool> held(3 * n, false);
  for (std::size_t i = n; i < 2 * n; ++i) held[i] = true;
  return held;
}

void hold_row(const GridSpec& grid, int row, std::vector<bool>& held) {
  const std::size_t n = held.size() / 3;
  for (int c = 0; c < grid.cols; ++c) {
    for (std::size_t axis = 0; axis < 3; ++axis) held[axis * n + grid.index(row, c)] = true;
  }
}

Check relative(int test, std::string what, double exact, double found, double goal,
               const GridSpec& grid) {
  return {test,
          std::move(what),
          exact,
          found,
          std::abs(found - exact) / std::abs(exact),
          goal,
          false,
          fmt::format("{}x{}", grid.rows, grid.cols)};
}

}  // namespace drape::simulate

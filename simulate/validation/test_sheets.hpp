// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <string>

#include "simulate/validation/test_equilibrium.hpp"

namespace drape::simulate {

inline constexpr double kGravity = 9.80665;  ///< m/s2
inline constexpr double kLength = 0.1;       ///< m, of strips
inline constexpr double kBending = 7.7e-6;   ///< N m, of strips

/// Linear laws, the same along warp and weft.
[[nodiscard]] ClothLaws linear_laws(double density_kg_per_m2, double tensile_n_per_m,
                                    double shear_n_per_m, double bending_n_m);

/// Positions by a map from material coordinates (m) to space.
template <class Map>
[[nodiscard]] Field shaped(const GridSpec& grid, Map map) {
  Field x(3 * static_cast<std::size_t>(grid.count()));
  for (int r = 0; r < grid.rows; ++r)
    for (int c = 0; c < grid.cols; ++c)
      put_at(x, grid.index(r, c), map(r * grid.warp_spacing_m(), c * grid.weft_spacing_m()));
  return x;
}

/// Each particle's weight for a gravity vector.
[[nodiscard]] Field weight(const Cloth& cloth, const Eigen::Vector3d& gravity_m_per_s2);

/// Coordinates that do not move: all of some rows; with `in_plane` also every y, for shapes of a
/// strip in the plane x, z.
[[nodiscard]] std::vector<bool> held_rows(const GridSpec& grid, std::initializer_list<int> rows,
                                          bool in_plane = true);

/// Expects a value within a fraction `goal` of its closed form; prints both.
void expect_relative(const std::string& what, double exact, double found, double goal);
/// Expects an error below, or an order above, its goal; prints both.
void expect_at_most(const std::string& what, double found, double goal);
void expect_at_least(const std::string& what, double found, double goal);

}  // namespace drape::simulate

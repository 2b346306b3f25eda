// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <string>

#include "simulate/cloth/test_grid.hpp"
#include "simulate/validation/test_equilibrium.hpp"

namespace drape::simulate {

inline constexpr double kGravity = 9.80665;  ///< m/s2
inline constexpr double kLength = 0.1;       ///< m, of strips
inline constexpr double kBending = 7.7e-6;   ///< N m, of strips

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

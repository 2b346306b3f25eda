// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace drape::simulate {

/// Force of an object or the table on one place of the sheet, a mixture of up to four particles,
/// as the solver found it; or one layer of the sheet to another, whose particles come last and have
/// negative weights. With these in hand a checker only has to look, not to search.
struct ContactForce {
  /// Obstacle of the scene; their number stands for the table, one more for the sheet itself.
  int shape = 0;
  std::array<int, 4> particle{};
  std::array<double, 4> weight{};
  Eigen::Vector3d force_in_world = Eigen::Vector3d::Zero();  ///< N
};

/// contact_forces.csv of a simulation. Reading throws Error(bad_input) for an index that is no
/// whole number from 0.
[[nodiscard]] std::string contact_forces_csv(const std::vector<ContactForce>& forces);
[[nodiscard]] std::vector<ContactForce> read_contact_forces(const std::filesystem::path& file);

}  // namespace drape::simulate

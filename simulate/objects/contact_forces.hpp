// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace drape::simulate {

/// Force of an object or the table on one place of the sheet, a weighted sum of up to four nodes,
/// as found by the solver; or the force between two layers, where the nodes of the second have
/// negative weights. A checker thus only needs to verify contacts, not to find them.
struct ContactForce {
  /// Index of the scene's obstacle; their number means the table, one more the sheet itself.
  int shape = 0;
  std::array<int, 4> particle{};
  std::array<double, 4> weight{};
  Eigen::Vector3d force_in_world = Eigen::Vector3d::Zero();  ///< N
};

/// Content of contact_forces.csv. Reading throws Error(bad_input) for an index that is not a
/// non-negative integer.
[[nodiscard]] std::string contact_forces_csv(const std::vector<ContactForce>& forces);
[[nodiscard]] std::vector<ContactForce> read_contact_forces(const std::filesystem::path& file);

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/objects/contact_forces.hpp"

#include <cmath>
#include <limits>

#include "core/error.hpp"
#include "core/files/csv.hpp"
#include "simulate/fabric/csv_text.hpp"

namespace drape::simulate {
namespace {

const std::vector<std::string>& contact_force_columns() {
  static const std::vector<std::string> names = {
      "object",   "particle_1", "particle_2", "particle_3", "particle_4", "weight_1",
      "weight_2", "weight_3",   "weight_4",   "force_x_N",  "force_y_N",  "force_z_N"};
  return names;
}

constexpr int kIndices = 5;

}  // namespace

std::string contact_forces_csv(const std::vector<ContactForce>& forces) {
  std::vector<std::vector<double>> columns(contact_force_columns().size());
  for (const ContactForce& f : forces) {
    columns[0].push_back(f.shape);
    for (int k = 0; k < 4; ++k) {
      columns[1 + k].push_back(f.particle[k]);
      columns[5 + k].push_back(f.weight[k]);
    }
    for (int axis = 0; axis < 3; ++axis) columns[9 + axis].push_back(f.force_in_world[axis]);
  }
  return csv_text(contact_force_columns(), columns);
}

std::vector<ContactForce> read_contact_forces(const std::filesystem::path& file) {
  const Csv csv = read_csv(file, contact_force_columns());
  std::vector<ContactForce> forces(csv.lines.size());
  for (std::size_t i = 0; i < forces.size(); ++i) {
    for (int c = 0; c < kIndices; ++c) {
      const double index = csv.columns[c][i];
      if (!(index >= 0 && index < std::numeric_limits<int>::max() && index == std::floor(index))) {
        throw bad_input("an index that is no whole number from 0",
                        {.file = file.string(), .line = csv.lines[i], .field = csv.names[c]},
                        "simulate again");
      }
      (c == 0 ? forces[i].shape : forces[i].particle[c - 1]) = static_cast<int>(index);
    }
    for (int k = 0; k < 4; ++k) forces[i].weight[k] = csv.columns[5 + k][i];
    for (int axis = 0; axis < 3; ++axis) forces[i].force_in_world[axis] = csv.columns[9 + axis][i];
  }
  return forces;
}

}  // namespace drape::simulate

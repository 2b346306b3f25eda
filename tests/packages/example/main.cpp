// SPDX-License-Identifier: Apache-2.0
// The energy of a patch of cloth that is bent to a quarter of a cylinder, and its largest force.
#include <cmath>
#include <cstdio>

#include "simulate/cloth/cloth.hpp"

int main() {
  using namespace drape;
  const simulate::GridSpec grid{21, 21, {0.2, 0.2}};
  simulate::ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  for (int i = 0; i < 2; ++i) {
    laws.tensile[i].slope = 500;   // N/m
    laws.bending[i].slope = 8e-6;  // N m
  }
  laws.shear.slope = 30;  // N/(m rad)
  simulate::Cloth cloth(grid, laws, simulate::MassRule::area);
  const double radius_m = 0.4 / M_PI;
  simulate::Field position(3 * grid.count()), force(position.size());
  for (int i = 0; i < grid.count(); ++i) {
    const int row = i / grid.cols;
    const double angle = row * grid.warp_spacing_m() / radius_m;
    position[i] = radius_m * std::sin(angle);
    position[grid.count() + i] = (i % grid.cols) * grid.weft_spacing_m();
    position[2 * grid.count() + i] = radius_m * (1 - std::cos(angle));
  }
  cloth.add_forces(position, nullptr, force);
  double largest_n = 0;
  for (const double f : force) largest_n = std::max(largest_n, std::abs(f));
  std::printf("bending %.3f uJ, largest force %.3f mN, mass %.2f g\n",
              cloth.energies(position).bending_j / 1e-6, largest_n * 1e3,
              cloth.total_mass_kg() * 1e3);
}

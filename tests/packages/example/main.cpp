// SPDX-License-Identifier: Apache-2.0
// Prints the energy of a patch of cloth bent to a quarter of a cylinder, and its largest force.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "simulate/mesh/mesh_cloth.hpp"

int main() {
  using namespace drape;
  simulate::ClothLaws laws;
  laws.density_kg_per_m2 = 0.15;
  for (int i = 0; i < 2; ++i) {
    laws.tensile[i].slope = 500;   // N/m
    laws.bending[i].slope = 8e-6;  // N m
  }
  laws.shear.slope = 30;  // N/(m rad)
  const double side_m = 0.2, radius_m = 0.4 / M_PI;
  simulate::ClothOutline outline;
  outline.outer = {{0, 0}, {side_m, 0}, {side_m, side_m}, {0, side_m}};
  const simulate::MeshCloth cloth(simulate::triangulated(outline, {.spacing_m = 0.01}), laws);
  const simulate::MeshCloth::State state = cloth.state_of([&](const Eigen::Vector2d& p) {
    const double angle = p.x() / radius_m;
    return simulate::MeshCloth::Jet{
        {radius_m * std::sin(angle), p.y(), radius_m * (1 - std::cos(angle))},
        {std::cos(angle), 0, std::sin(angle)},
        {0, 1, 0}};
  });
  simulate::MeshCloth::State force(state.size(), Eigen::Vector3d::Zero());
  cloth.add_forces(state, force);
  double largest_n = 0;
  for (int i = 0; i < cloth.points(); ++i) largest_n = std::max(largest_n, force[i].norm());
  std::printf("bending %.3f uJ, largest force %.3f mN, mass %.2f g\n",
              cloth.energies(state).bending_j / 1e-6, largest_n * 1e3,
              std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0) * 1e3);
}

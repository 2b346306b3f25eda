// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/paper/paper_cloth.hpp"

namespace drape::simulate {

/// Self-contact of the cloth (paper section 4.3): particles and triangles of cells, and pairs of
/// edges, without common particles, repel when closer than a thickness, by a spring along the line
/// between their nearest points that carries a particle's weight at 2 um, with a fifth of critical
/// damping. No friction. At 1 m/s layers approach by less than the thickness.
class PaperLayers {
 public:
  /// `thickness_m` 0 disables self-contact.
  PaperLayers(const ParticleGrid& grid, double particle_kg, double gravity_m_per_s2,
              double thickness_m);

  /// Updates the list of pairs if particles have moved so far that others may touch.
  void follow(const Particles& position);
  /// Adds the forces (N) of the listed pairs, including damping if `velocity` (m/s) is given;
  /// returns their energy (J).
  double add_forces(const Particles& position, const Particles* velocity, Particles& force) const;
  [[nodiscard]] double energy_j(const Particles& position) const;
  /// Bound of their contribution to the highest squared frequency (1/s^2).
  [[nodiscard]] double stiffness_bound_per_s2() const;

 private:
  /// A triangle of a cell, with the particles and edges that no earlier one has.
  struct Facet {
    std::array<int, 3> node{};
    std::vector<int> own;
    std::vector<std::array<int, 2>> edges;
  };
  void offer(const LayerPair& pair, const Nodes& nodes);

  std::vector<Facet> facets_;
  BoxTree tree_;
  Particles listed_;  ///< positions when pairs were listed; empty if not yet
  std::vector<LayerPair> pairs_;
  double thickness_, n_per_m_, damping_n_s_per_m_, per_kg_;
};

}  // namespace drape::simulate

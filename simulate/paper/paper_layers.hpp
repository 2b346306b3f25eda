// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/paper/paper_cloth.hpp"

namespace drape::simulate {

/// Cloth that meets itself (paper section 4.3): particles and the triangles of cells, and edges,
/// which have no particle in common, press when they are nearer than a thickness, by a spring along
/// the line between their nearest points that bears a particle's weight at 2 um, a fifth of
/// critically damped. No friction. At 1 m/s layers come nearer by less than the thickness.
class PaperLayers {
 public:
  /// `thickness_m` 0: the cloth does not meet itself.
  PaperLayers(const ParticleGrid& grid, double particle_kg, double gravity_m_per_s2,
              double thickness_m);

  /// Lists the pairs again where particles have gone so far that others may press.
  void follow(const Particles& position);
  /// Adds the forces (N) of the listed pairs, with `velocity` (m/s) also the damping; returns their
  /// energy (J).
  double add_forces(const Particles& position, const Particles* velocity, Particles& force) const;
  [[nodiscard]] double energy_j(const Particles& position) const;
  /// Bound of what they add to the square of the highest frequency (1/s^2).
  [[nodiscard]] double stiffness_bound_per_s2() const;

 private:
  /// A triangle of a cell, and the particles and edges that no earlier one has.
  struct Facet {
    std::array<int, 3> node{};
    std::vector<int> own;
    std::vector<std::array<int, 2>> edges;
  };
  void offer(const LayerPair& pair, const Nodes& nodes);

  std::vector<Facet> facets_;
  BoxTree tree_;
  Particles listed_;  ///< places where pairs were listed; empty: not yet
  std::vector<LayerPair> pairs_;
  double thickness_, n_per_m_, damping_n_s_per_m_, per_kg_;
};

}  // namespace drape::simulate

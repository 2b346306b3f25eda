// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/surface.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// Cloth that pushes cloth: the facets of a piece's surface, by pairs of a node and a facet and of
/// two edges, with the law of the particle grid's layers (contact/layer_pair.hpp): a spring from
/// one thickness on, of 2 um per mean node's weight, and a barrier below half of it (Li et al.
/// 2020, Incremental Potential Contact). Pairs have no node in common and press nearer than a
/// quarter of what they are apart on the flat piece, so that neighbours do not press for being
/// neighbours. No friction.
///
/// The energy is a function of the state alone between two settlings: only the part of edges that
/// are nearly parallel, whose distance is not smooth, is that of the last settle().
class LayerPushes : public Pushes {
 public:
  LayerPushes(const MeshCloth& cloth, double gravity_m_per_s2, double thickness_m);

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override;
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override;
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override;
  void settle(const MeshCloth::State& state) override;
  /// Leaves each pair a fifth of its distance (additive conservative advancement: Li, Kaufman and
  /// Jiang 2021); led cloth keeps half a thickness, which no force would open again.
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override;

  /// Forces of layers on each other, by nodes of the surface; `shape` is that of the cloth itself.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state, int shape);

 private:
  /// A facet, and the nodes and edges that no earlier one has.
  struct Facet {
    std::array<int, 3> node{};
    std::vector<int> own;
    std::vector<std::array<int, 2>> edges;
  };
  struct Pair {
    LayerPair of;
    double thickness_m = 0;  ///< nearer than this it presses
    double part = 1;         ///< share that presses: less where edges are nearly parallel
  };
  struct Press {
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
    Eigen::Vector3d normal;  ///< from the second layer to the first
    double energy_j = 0, force_n = 0, n_per_m = 0;
  };
  [[nodiscard]] Field nodes_of(const MeshCloth::State& state) const;
  [[nodiscard]] bool is_listed(const Field& nodes) const;
  void list(const Field& nodes, const Field& to);
  void list_facets(const Facet& a, const Facet& b);
  void offer(const LayerPair& pair);
  void look(const MeshCloth::State& state);

  const MeshCloth& cloth_;
  ClothSurface surface_;
  double thickness_, stiffness_;
  std::vector<Facet> facets_;
  Field flat_;  ///< the nodes in (warp, weft, 0)
  BoxTree tree_;
  Field listed_;                 ///< where pairs were listed; empty: not yet
  std::vector<double> allowed_;  ///< from there, per node, beside the mean displacement (m)
  Field settled_;                ///< where parts are from
  std::vector<Pair> pairs_;      ///< all that can press while nodes go no farther than allowed
  MeshCloth::State seen_;        ///< looked at last
  std::vector<Press> presses_;
};

}  // namespace drape::simulate

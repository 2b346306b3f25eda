// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/contact/box_tree.hpp"
#include "simulate/contact/layer_pair.hpp"
#include "simulate/drape/contact_memory.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/surface.hpp"
#include "simulate/objects/contact_forces.hpp"

namespace drape::simulate {

/// Cloth that pushes cloth: the facets of a cloth's surface, by pairs of a node and a facet and of
/// two edges (contact/layer_pair.hpp): a spring from one thickness on, of 2 um per mean node's
/// weight, and a barrier below half of it (Li et al. 2020, Incremental Potential Contact). Pairs
/// have no node in common and press nearer than a quarter of what they are apart on the flat cloth,
/// so that neighbours do not press for being neighbours.
///
/// Friction is that of objects (object_pushes.hpp): each pair that presses has a tangential spring
/// between its two nearest places, which settle() moves.
///
/// The energy is a function of the state alone between two settlings: only the part of edges that
/// are nearly parallel, whose distance is not smooth, is that of the last settle().
class LayerPushes : public Pushes {
 public:
  LayerPushes(const MeshCloth& cloth, double friction, double gravity_m_per_s2, double thickness_m);

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override;
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override;
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override;
  void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                    MeshCloth::State& product) override;
  void settle(const MeshCloth::State& state) override;
  /// Leaves each pair a fifth of its distance (additive conservative advancement: Li, Kaufman and
  /// Jiang 2021); led cloth keeps half a thickness, which no force would open again.
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override;

  /// Forces of layers on each other, by nodes of the surface; `shape` is that of the cloth itself.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state, int shape);

  /// As ObjectPushes: writes its part of the memory, and goes on from it.
  void remember(ContactMemory& memory) const;
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

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
    LayerPair of;
    std::array<double, 4> weight{};
    Eigen::Vector3d normal;  ///< from the second layer to the first
    double energy_j = 0, force_n = 0, n_per_m = 0;
  };
  /// Spring between the places of a pair that were nearest when it was settled; its place is how
  /// far they were apart.
  struct Spring {
    LayerPair of;
    std::array<double, 4> weight{};
    ContactMemory::Grip grip;
  };
  [[nodiscard]] Eigen::Vector3d stretch_of(const Spring& spring) const;
  [[nodiscard]] Eigen::Vector3d force_of(const Spring& spring) const;
  [[nodiscard]] const Spring* spring_of(const LayerPair& pair) const;
  /// Material places of the first and of the second piece.
  [[nodiscard]] std::array<Eigen::Vector2d, 2> material_of(
      const LayerPair& pair, const std::array<double, 4>& weight) const;
  void add_springs(const MeshCloth::State& state);
  [[nodiscard]] bool is_listed(const Nodes& nodes) const;
  void list(const Nodes& nodes, const Nodes& to);
  void list_facets(const Facet& a, const Facet& b);
  void offer(const LayerPair& pair);
  void look(const MeshCloth::State& state);

  const MeshCloth& cloth_;
  ClothSurface surface_;
  double friction_, thickness_, stiffness_;
  std::vector<Facet> facets_;
  Nodes flat_;  ///< the nodes in (warp, weft, 0)
  BoxTree tree_;
  Nodes listed_;                 ///< where pairs were listed; empty: not yet
  std::vector<double> allowed_;  ///< from there, per node, beside the mean displacement (m)
  Nodes settled_;                ///< where parts are from
  std::vector<Pair> pairs_;      ///< all that can press while nodes go no farther than allowed
  MeshCloth::State seen_;        ///< looked at last
  Nodes nodes_;                  ///< of its surface
  std::vector<Press> presses_;
  std::vector<Spring> springs_;  ///< by pair
  SurfaceProducts products_;     ///< of the state looked at ...
  bool are_products_ = false;    ///< ... if they are listed
};

}  // namespace drape::simulate

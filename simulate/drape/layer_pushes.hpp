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

/// Contact of cloth with itself, between facets of its surface, as pairs of a node and a facet or
/// of two edges (contact/layer_pair.hpp): a spring below one thickness, which carries a mean node's
/// weight at 2 um, and a barrier below half of it (Li et al. 2020, Incremental Potential Contact).
/// Pairs have no common node and only act closer than a quarter of their distance on the flat
/// cloth, so that neighbours on the sheet do not repel each other.
///
/// Friction is as on objects (object_pushes.hpp): each pair in contact has a tangential spring
/// between its two nearest points, which settle() updates.
///
/// Between two calls of settle() the energy depends only on the state; the weight of nearly
/// parallel edges, whose distance is not smooth, is kept from the last call.
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
  /// Jiang 2021). In an imposed motion it keeps half a thickness, since no force could restore it.
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override;

  /// Contact forces between layers, by nodes of the surface; `shape` is the index of the cloth.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state, int shape);

  /// Like ObjectPushes: writes its part of the memory, and restores it.
  void remember(ContactMemory& memory) const;
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

 private:
  /// A facet, with the nodes and edges that no earlier one has.
  struct Facet {
    std::array<int, 3> node{};
    std::vector<int> own;
    std::vector<std::array<int, 2>> edges;
  };
  struct Pair {
    LayerPair of;
    double thickness_m = 0;  ///< distance below which it acts
    double part = 1;         ///< weight, reduced for nearly parallel edges
  };
  struct Press {
    LayerPair of;
    std::array<double, 4> weight{};
    Eigen::Vector3d normal;  ///< direction from the second layer to the first
    double energy_j = 0, force_n = 0, n_per_m = 0;
  };
  /// Friction spring between the nearest places of a pair when it was settled; its place is their
  /// separation at that time.
  struct Spring {
    LayerPair of;
    std::array<double, 4> weight{};
    ContactMemory::Grip grip;
  };
  [[nodiscard]] Eigen::Vector3d stretch_of(const Spring& spring) const;
  [[nodiscard]] Eigen::Vector3d force_of(const Spring& spring) const;
  [[nodiscard]] const Spring* spring_of(const LayerPair& pair) const;
  /// Material coordinates of the nearest places on the first and second part.
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
  Nodes flat_;  ///< nodes in material coordinates (warp, weft, 0)
  BoxTree tree_;
  Nodes listed_;                 ///< nodes when pairs were listed; empty if not yet
  std::vector<double> allowed_;  ///< displacement of each node from there, beside the mean one (m)
  Nodes settled_;                ///< nodes at the last settling, for the weights
  std::vector<Pair> pairs_;      ///< all possible contacts while nodes move no farther than allowed
  MeshCloth::State seen_;        ///< last state evaluated
  Nodes nodes_;                  ///< its surface nodes
  std::vector<Press> presses_;
  std::vector<Spring> springs_;  ///< sorted by pair
  SurfaceProducts products_;     ///< second derivatives at that state ...
  bool are_products_ = false;    ///< ... if computed
};

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/drape/contact_memory.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/surface.hpp"
#include "simulate/objects/contact_forces.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// Contact of a cloth with objects and table.
///
/// Places all over the surface of the cloth push back, each for its share of the area, with the
/// pressure p = k d (1 + d^2 / d0^2) at depth d, where k gives 0.1 um under the cloth's own weight
/// and d0 = 2 um, so that edges and corners of any sharpness penetrate by some hundredths of a
/// millimetre only. Places are 0.5 mm apart on the cloth (1 mm on meshes of 10 mm), half of that on
/// objects with sharp edges. While a cloth falls p = k d / 10, since stiff contact makes the steps
/// of a descent short; stages lead from there to the firm law. Facets with a corner held on a
/// surface are left out: two pins on a round body hold the cloth between them inside it.
///
/// A facet whose corners all face one flat face pushes back at its nodes only: the gap is linear
/// between them, so no point is deeper. settle() selects these facets, since a change during a
/// descent would make the energy jump; once contact is firm, facets only leave the selection.
///
/// Only listed places are evaluated: those that may touch before a node has moved by a margin,
/// which adapts to the motion. The energy does not depend on the list.
///
/// Friction is elastic-plastic: each place in contact has a tangential spring that yields at the
/// coefficient times its pressure. settle() updates it once per load increment or time step; until
/// then limits and anchors of the springs keep their last values, so that the energy is well
/// defined.
class ObjectPushes : public Pushes {
 public:
  /// Starts soft, for a fall. All arguments must outlive this object.
  ObjectPushes(const MeshCloth& cloth, const std::vector<bool>& held,
               const Surroundings& surroundings, double friction, double gravity_m_per_s2);

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override;
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override;
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override;
  void settle(const MeshCloth::State& state) override;
  void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                    MeshCloth::State& product) override;

  /// Prevents nodes from passing through the middle of an object to its other side.
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override;

  [[nodiscard]] bool holds() const { return friction_ > 0; }
  [[nodiscard]] bool is_firm() const { return firmness_ == kFirm; }
  /// Brings the pressure law one stage closer to that of a rest.
  void make_firmer(const MeshCloth::State& state);

  /// Forces (N) at places of the surface's facets, by their nodes (the points, then the midpoints
  /// of sides); the fourth has no weight.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state);

  /// Writes its part of the memory.
  void remember(ContactMemory& memory) const;
  /// Restores a memory in a state of this cloth. Springs from another mesh keep their force per
  /// area, rotated into the surface and limited by friction.
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

 private:
  static constexpr int kFirm = 5;
  /// A place of the cloth close to an object.
  struct Site {
    int id = 0;  ///< place * number of shapes + shape
    int facet = 0, shape = 0;
    int node = -1;           ///< surface node, if one pushes back; -1 for a place of the facet
    Eigen::Vector3d weight;  ///< weights of the facet's nodes
    double area_m2 = 0;
    ContactMemory::Grip grip;
    Eigen::Vector3d looked_at;  ///< position at which the gap was evaluated
    double gap_m = 0, pressure_pa = 0, n_per_m3 = 0;
    Eigen::Vector3d place, normal, force_n;  ///< last evaluation, where the force acts

    [[nodiscard]] bool acts() const { return pressure_pa > 0 || grip.limit > 0; }
  };
  /// A place of a facet, with its share of the area.
  struct Place {
    Eigen::Vector3d weight;
    double share = 0;
  };
  [[nodiscard]] double places_m() const;
  [[nodiscard]] double sharp_places_m() const;
  void divide();
  [[nodiscard]] int cuts_of(int facet, int shape) const;
  [[nodiscard]] static double press(Site& site, double k_n_per_m3, double b_per_m2);
  void see(const MeshCloth::State& state);
  void look(const MeshCloth::State& state);
  void wake();
  void list();
  void choose();
  bool weigh();
  [[nodiscard]] double gap_beyond(int shape, int facet, int facets) const;
  [[nodiscard]] double reach_of(const Site& site) const;
  [[nodiscard]] Site site_of(int id, int facet) const;
  [[nodiscard]] bool is_on_pin(int facet, int shape) const;
  [[nodiscard]] Eigen::Vector2d material_of(const Site& site) const;
  [[nodiscard]] ContactForce force_of(const Site& site) const;
  [[nodiscard]] Eigen::Vector3d place_of(const Site& site) const;
  [[nodiscard]] Eigen::Vector3d stretch_of(const Site& site) const {
    return site.grip.stretch_at(site.place);
  }
  [[nodiscard]] std::size_t at(int item, int shape) const {
    return static_cast<std::size_t>(item) * surroundings_.count() + shape;
  }
  [[nodiscard]] bool is_awake(int triangle, int shape) const {
    return until_m_[at(triangle, shape)] <= travelled_m_ + reach_m_;
  }

  const MeshCloth& cloth_;
  const std::vector<bool>& held_;
  const Surroundings& surroundings_;
  ClothSurface surface_;
  double friction_, stiffness_, grip_stiffness_;  ///< N/m^3
  double reach_m_ = 0, nodes_m_ = 0;              ///< distance between nodes
  int firmness_ = 0;
  std::vector<int> cuts_, first_;           ///< by facet: subdivisions of a side; first place
  std::vector<std::vector<Place>> places_;  ///< by number of subdivisions
  std::vector<std::array<bool, 3>> owns_;   ///< by facet: true if no earlier facet has that node
  std::vector<int> first_of_node_, facet_of_node_;  ///< facets adjacent to a node
  std::vector<bool> by_nodes_;        ///< by facet and shape; empty if not selected yet
  std::vector<double> node_area_m2_;  ///< by node and shape; empty if not computed yet
  std::vector<Site> sites_;           ///< sorted by id
  double energy_j_ = 0;               ///< for the last state evaluated
  MeshCloth::State on_nodes_;         ///< forces (N) at that state
  std::vector<Site> before_;          ///< sites of the previous list, kept for reuse of memory
  MeshCloth::State seen_, nodes_;     ///< last state seen, and its surface nodes
  bool looked_ = false;               ///< energy and forces belong to the last state seen
  SurfaceProducts products_;          ///< second derivatives at the state evaluated ...
  bool are_products_ = false;         ///< ... if computed
  MeshCloth::State listed_;           ///< nodes when sites were listed
  double margin_m_ = 0;               ///< largest gap of listed sites
  std::vector<double> free_m2_;       ///< squared displacement that the list permits each node
  int looks_ = 0;                     ///< evaluations with this list
  double travelled_m_ = 0;            ///< sum of the largest displacements over all lists
  /// By triangle, or facet, and shape: travelled_m_ until which it cannot be near.
  std::vector<double> until_m_, facet_until_m_;
};

}  // namespace drape::simulate

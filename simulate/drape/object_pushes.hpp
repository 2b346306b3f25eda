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

/// Objects and table that push a cloth.
///
/// Places all over the cloth's surface press, each for its share of the area: at depth d by
/// p = k d (1 + d^2 / d0^2), where k lets cloth lie 0.1 um deep under its own weight and d0 = 2 um,
/// so that edges and corners of any sharpness are entered by some hundredths of a millimetre. The
/// places are 0.5 mm apart on the cloth (1 mm on meshes of 10 mm), half that on objects of sharp
/// edges. While a cloth falls p = k d / 10, for stiff places make a descent's steps short; then
/// stages lead from there to the firm law. Facets with a corner that is held on a surface are left
/// out: two pins on a round body hold the cloth between them inside it.
///
/// A facet whose corners all face one flat face presses by its nodes alone: the gap is linear
/// between them, so nothing is deeper. Which facets do is chosen by settle(), for a choice amid a
/// descent would make its energy jump; once places are firm, a facet only leaves them.
///
/// Only listed places are looked at: those that may touch before a node has moved by a margin,
/// which follows the motion. The energy does not depend on it.
///
/// Friction is elastic and plastic: each place that presses has a tangential spring that yields at
/// the coefficient times its pressure; settle() moves it, once per increment of load or of time.
/// Limits and places of springs stay those of the last settle() meanwhile, so that there is an
/// energy.
class ObjectPushes : public Pushes {
 public:
  /// Soft, for a fall. No argument may go before this object.
  ObjectPushes(const MeshCloth& cloth, const std::vector<bool>& held,
               const Surroundings& surroundings, double friction, double gravity_m_per_s2);

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override;
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override;
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override;
  void settle(const MeshCloth::State& state) override;
  void add_products(const MeshCloth::State& state, const MeshCloth::State& direction,
                    MeshCloth::State& product) override;

  /// No node goes through the middle of an object on its way to the other side.
  [[nodiscard]] double clear_part(const MeshCloth::State& from, const MeshCloth::State& to,
                                  bool led) override;

  [[nodiscard]] bool holds() const { return friction_ > 0; }
  [[nodiscard]] bool is_firm() const { return firmness_ == kFirm; }
  /// Takes the pressure's law a stage nearer to that of a rest.
  void make_firmer(const MeshCloth::State& state);

  /// Forces (N) on places of the surface's facets, by their nodes (the points, then the middles of
  /// sides); the fourth has no weight.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state);

  /// Writes its part of the memory.
  void remember(ContactMemory& memory) const;
  /// Goes on from a memory in a state of this cloth. Springs of another mesh keep their force per
  /// area, turned into the surface and within the limit of friction.
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

 private:
  static constexpr int kFirm = 5;
  /// A place of the cloth near an object.
  struct Site {
    int id = 0;  ///< place times shapes, plus shape
    int facet = 0, shape = 0;
    int node = -1;           ///< of the surface, where a node presses; -1: a place of the facet
    Eigen::Vector3d weight;  ///< of the facet's nodes
    double area_m2 = 0;
    ContactMemory::Grip grip;
    Eigen::Vector3d looked_at;  ///< where the gap is from
    double gap_m = 0, pressure_pa = 0, n_per_m3 = 0;
    Eigen::Vector3d place, normal, force_n;  ///< as looked at last, where it acts

    [[nodiscard]] bool acts() const { return pressure_pa > 0 || grip.limit > 0; }
  };
  /// A place of a facet, and its share of the area.
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
  double reach_m_ = 0, nodes_m_ = 0;              ///< distance of nodes
  int firmness_ = 0;
  std::vector<int> cuts_, first_;                   ///< by facet: parts of a side; first place
  std::vector<std::vector<Place>> places_;          ///< by cuts
  std::vector<std::array<bool, 3>> owns_;           ///< by facet: no facet before has that node
  std::vector<int> first_of_node_, facet_of_node_;  ///< facets around a node
  std::vector<bool> by_nodes_;                      ///< by facet and shape; empty: not chosen yet
  std::vector<double> node_area_m2_;                ///< by node and shape; empty: not weighed yet
  std::vector<Site> sites_;                         ///< by id
  double energy_j_ = 0;                             ///< of the state looked at last
  MeshCloth::State on_nodes_;                       ///< forces (N) there
  std::vector<Site> before_;                        ///< those of the last list; kept for its memory
  MeshCloth::State seen_, nodes_;                   ///< the state seen last, and its surface
  bool looked_ = false;          ///< energy and forces are those of the state seen last
  SurfaceProducts products_;     ///< of the state looked at ...
  bool are_products_ = false;    ///< ... if they are listed
  MeshCloth::State listed_;      ///< nodes when sites were listed
  double margin_m_ = 0;          ///< gap up to which sites were listed
  std::vector<double> free_m2_;  ///< squared displacement that a node may have meanwhile
  int looks_ = 0;                ///< at this list
  double travelled_m_ = 0;       ///< sum of the largest displacements between lists
  /// By triangle, or facet, and shape: travelled_m_ until it may be near.
  std::vector<double> until_m_, facet_until_m_;
};

}  // namespace drape::simulate

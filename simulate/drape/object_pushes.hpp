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
/// edges. While a cloth falls they are fewer, and
/// p = k d / 10 is softer, for stiff places make a descent's steps short. Facets with a corner that
/// is held on a surface are left out: two pins on a round body hold the cloth between them inside
/// it.
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
  /// Makes places as many as they are at a rest, then as stiff.
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
  static constexpr int kFirm = 2;
  /// A place of the cloth near an object.
  struct Site {
    int id = 0;  ///< place times shapes, plus shape
    int facet = 0, shape = 0;
    Eigen::Vector3d weight;  ///< of the facet's nodes
    double area_m2 = 0;
    ContactMemory::Grip grip;
    Eigen::Vector3d looked_at;  ///< where the gap is from
    double gap_m = 0, pressure_pa = 0, energy_j_per_m2 = 0, n_per_m3 = 0;
    Eigen::Vector3d place;            ///< as looked at last
    Eigen::Vector3d normal, force_n;  ///< where it acts

    [[nodiscard]] bool acts() const { return pressure_pa > 0 || grip.limit > 0; }
  };
  /// Second derivative of the energy of a facet's places, by its nodes.
  struct FacetProducts {
    int facet = 0;
    Eigen::Matrix<double, 9, 9> second;
  };
  [[nodiscard]] double places_m() const;
  [[nodiscard]] double sharp_places_m() const;
  void divide();
  [[nodiscard]] int cuts_of(int facet, int shape) const;
  void press(Site& site) const;
  void look(const MeshCloth::State& state);
  void list();
  [[nodiscard]] Site site_of(int id, int facet) const;
  [[nodiscard]] bool is_on_pin(int facet, int shape) const;
  [[nodiscard]] Eigen::Vector2d material_of(const Site& site) const;
  [[nodiscard]] Eigen::Vector3d product_of(const Site& site,
                                           const Eigen::Vector3d& displacement) const;
  void list_products();
  [[nodiscard]] Eigen::Vector3d place_of(const Site& site) const;
  [[nodiscard]] Eigen::Vector3d stretch_of(const Site& site) const {
    return site.grip.stretch_at(site.place);
  }

  const MeshCloth& cloth_;
  const std::vector<bool>& held_;
  const Surroundings& surroundings_;
  ClothSurface surface_;
  double friction_, stiffness_, grip_stiffness_;  ///< N/m^3
  double reach_m_ = 0;
  int firmness_ = 0;
  std::vector<int> cuts_, first_;        ///< by facet: parts of a side; first place
  std::vector<Site> sites_;              ///< by id
  double energy_j_ = 0;                  ///< of the state looked at last
  MeshCloth::State on_nodes_;            ///< forces (N) there
  std::vector<Site> before_;             ///< those of the last list; kept for its memory
  MeshCloth::State seen_, nodes_;        ///< the state looked at last, and its surface
  MeshCloth::State products_at_;         ///< state of products_; empty: none
  std::vector<FacetProducts> products_;  ///< by facet, where something acts
  MeshCloth::State listed_;              ///< nodes when sites were listed
  double travelled_m_ = 0;               ///< sum of the largest displacements between lists
  std::vector<double> until_m_;  ///< by triangle and shape: travelled_m_ until it may be near
};

}  // namespace drape::simulate

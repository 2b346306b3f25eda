// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "simulate/contact/layer_pair.hpp"
#include "simulate/mesh/descent.hpp"
#include "simulate/mesh/mesh_cloth.hpp"
#include "simulate/objects/cloth_files.hpp"
#include "simulate/objects/surroundings.hpp"

namespace drape::simulate {

/// State of contact: friction springs by material point. The same mesh continues from it exactly.
/// Another mesh of the same cloth takes the stretch of the springs at the nearest points, as a
/// force per area.
struct ContactMemory {
  /// Elastic-plastic friction spring between a point of the cloth and what it touches, as last
  /// updated by settle(). Values are per area (N/m^3, Pa) or absolute (N/m, N).
  struct Grip {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    Eigen::Vector3d stretch = Eigen::Vector3d::Zero();  ///< tangential (m)
    double limit = 0;  ///< coefficient times normal force: Pa on an object, N for a pair of layers

    /// Tangential stretch if the point is at `now`.
    [[nodiscard]] Eigen::Vector3d stretch_at(const Eigen::Vector3d& now) const {
      const Eigen::Vector3d moved = stretch + now - place;
      return moved - moved.dot(normal) * normal;
    }
    /// Secant stiffness at a stretch.
    [[nodiscard]] double stiffness_at(const Eigen::Vector3d& stretched, double stiffness) const {
      const double size = stiffness * stretched.norm();
      return stiffness * (size > limit ? limit / size : 1);
    }
    [[nodiscard]] double energy_at(const Eigen::Vector3d& stretched, double stiffness) const {
      const double size = stretched.norm(), most = limit / stiffness;
      return size <= most ? stiffness / 2 * size * size : limit * (size - most / 2);
    }
    /// Second derivative of the energy: a sliding spring resists only perpendicular to its stretch.
    [[nodiscard]] Eigen::Matrix3d second_at(const Eigen::Vector3d& stretched,
                                            double stiffness) const {
      constexpr double kSliding = 1 - 1e-6;  // relative to the limit
      const bool slides = stiffness * stretched.norm() >= kSliding * limit && !stretched.isZero(0);
      Eigen::Matrix3d second;
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d along = Eigen::Vector3d::Unit(axis) - normal[axis] * normal;
        if (slides) along -= along.dot(stretched) / stretched.squaredNorm() * stretched;
        second.col(axis) = stiffness_at(stretched, stiffness) * along;
      }
      return second;
    }
    /// Rotates the stretch into the tangent plane and lets it yield at the limit.
    void settle(double stiffness) {
      stretch -= stretch.dot(normal) * normal;
      stretch *= stiffness_at(stretch, stiffness) / stiffness;
    }
  };
  /// Transfer radius, in distances between the stored contact points.
  static constexpr double kReach = 2;

  /// A contact point of the cloth on an object.
  struct OnObject {
    int site = 0, shape = 0;  ///< index of the contact point on its mesh, and of the object
    Eigen::Vector2d material_m;
    double reach_m = 0;  ///< radius within which another mesh takes the spring over
    Grip grip;
  };
  /// Two points of the cloth in contact with each other, given by nodes of the surface.
  struct OnLayer {
    bool edges = false;
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
    Eigen::Vector2d first_m, second_m;  ///< material coordinates
    Grip grip;
  };
  std::vector<Eigen::Vector2d> mesh_m;  ///< points of the mesh
  double places_m = 0;                  ///< distance between contact points on objects
  int firmness = 0;                     ///< stage of the pressure law on objects
  std::vector<bool> by_nodes;           ///< facets that touch flat faces only; by facet and shape
  std::vector<OnObject> objects;        ///< in order of site
  std::vector<OnLayer> layers;
};

/// Contact of a cloth with objects and table.
///
/// Contact points all over the cloth's surface push back, each for its share of the area, with the
/// pressure p = k d (1 + d^2 / d0^2) at depth d. Here k gives 0.1 um under the cloth's own weight
/// and d0 = 2 um: edges and corners of any sharpness penetrate by a few hundredths of a millimetre.
/// Contact points are 0.5 mm apart on the cloth (1 mm on meshes of 10 mm), half of that on objects
/// with sharp edges. While a cloth falls p = k d / 10, since stiff contact shortens the steps of a
/// descent; stages lead from there to the firm law. Facets with a corner held on a surface are left
/// out: two pins on a round body hold the cloth between them inside it.
///
/// A facet whose corners all face one flat face pushes back at its nodes only: the gap is linear
/// between them, so no point is deeper. settle() selects these facets, since a change during a
/// descent would make the energy jump; once contact is firm, facets only leave the selection.
///
/// Only listed contact points are evaluated: those that may touch before a node has moved by a
/// margin, which adapts to the motion. The energy does not depend on the list.
///
/// Friction is elastic-plastic: each point in contact has a tangential spring that yields at the
/// coefficient times its pressure. settle() updates it once per load increment or time step. In
/// between, limits and anchors of the springs keep their values, so that the energy is well
/// defined.
class ObjectPushes : public Pushes {
 public:
  /// Spacing of contact points, and node displacement after which sites are listed again, on fine
  /// meshes.
  static constexpr double kPlaces_m = 0.5e-3;

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
  /// Moves the pressure law one stage closer to the firm one.
  void make_firmer(const MeshCloth::State& state);

  /// Forces (N) at points of the surface's facets, by their nodes (the points, then the edge
  /// midpoints); the fourth node has no weight.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state);

  /// Stores its part of the contact state.
  void remember(ContactMemory& memory) const;
  /// Restores the contact state for this cloth. Springs from another mesh keep their force per
  /// area, rotated into the surface and limited by friction.
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

 private:
  static constexpr int kFirm = 5;
  /// A contact point of the cloth close to an object.
  struct Site {
    int id = 0;  ///< contact point * number of shapes + shape
    int facet = 0, shape = 0;
    int node = -1;           ///< surface node, if one pushes back; -1 for a point inside the facet
    Eigen::Vector3d weight;  ///< weights of the facet's nodes
    double area_m2 = 0;
    ContactMemory::Grip grip;
    Eigen::Vector3d looked_at;  ///< position at which the gap was evaluated
    double gap_m = 0, pressure_pa = 0, n_per_m3 = 0;
    Eigen::Vector3d place, normal, force_n;  ///< last evaluation, where the force acts

    [[nodiscard]] bool acts() const { return pressure_pa > 0 || grip.limit > 0; }
  };
  /// A contact point of a facet, with its share of the area.
  struct Place {
    Eigen::Vector3d weight;
    double share = 0;
  };
  [[nodiscard]] double places_m() const { return reach_m_; }
  [[nodiscard]] double sharp_places_m() const { return std::min(kPlaces_m, reach_m_ / 2); }
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
  double sharp_m_ = 0;                            ///< edge radius below which points are finer
  int firmness_ = 0;
  std::vector<int> cuts_, first_;           ///< by facet: subdivisions of an edge; first point
  std::vector<std::vector<Place>> places_;  ///< by number of subdivisions
  std::vector<std::array<bool, 3>> owns_;   ///< by facet: true if no earlier facet has that node
  std::vector<int> first_of_node_, facet_of_node_;  ///< facets adjacent to a node
  std::vector<bool> by_nodes_;        ///< by facet and shape; empty if not selected yet
  std::vector<double> node_area_m2_;  ///< by node and shape; empty if not computed yet
  std::vector<Site> sites_;           ///< sorted by id
  double energy_j_ = 0;               ///< for the last state evaluated
  MeshCloth::State on_nodes_;         ///< forces (N) at that state
  std::vector<Site> before_;          ///< sites of the previous list, whose springs are reused
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

/// Contact of cloth with itself, between facets of its surface, as pairs of a node and a facet or
/// of two edges (contact/layer_pair.hpp). A spring acts below one thickness and carries a mean
/// node's weight at 2 um; a barrier acts below half of it (Li et al. 2020, Incremental Potential
/// Contact). Pairs have no common node and only act closer than a quarter of their distance on the
/// flat cloth, so that neighbours on the sheet do not repel each other.
///
/// Friction is as on objects: each pair in contact has a tangential spring between its two nearest
/// points, which settle() updates.
///
/// Between two calls of settle() the energy depends only on the state: the weight of nearly
/// parallel edges, whose distance is not smooth, keeps its value from the last call.
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

  /// Stores and restores its part of the contact state, as in ObjectPushes.
  void remember(ContactMemory& memory) const;
  void take_over(const ContactMemory& memory, const MeshCloth::State& state);

 private:
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
  /// Friction spring between the nearest points of a pair when last settled. Its position is their
  /// separation at that time.
  struct Spring {
    LayerPair of;
    std::array<double, 4> weight{};
    ContactMemory::Grip grip;
  };
  [[nodiscard]] Eigen::Vector3d stretch_of(const Spring& spring) const;
  [[nodiscard]] Eigen::Vector3d force_of(const Spring& spring) const;
  [[nodiscard]] const Spring* spring_of(const LayerPair& pair) const;
  /// Material coordinates of the nearest points on the first and second part.
  [[nodiscard]] std::array<Eigen::Vector2d, 2> material_of(
      const LayerPair& pair, const std::array<double, 4>& weight) const;
  void add_springs(const MeshCloth::State& state);
  [[nodiscard]] bool is_listed(const Nodes& nodes) const;
  void list(const Nodes& nodes, const Nodes& to);
  void offer(const LayerPair& pair);
  void look(const MeshCloth::State& state);

  const MeshCloth& cloth_;
  ClothSurface surface_;
  double friction_, thickness_, stiffness_;
  std::vector<LayerFacet> facets_;
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

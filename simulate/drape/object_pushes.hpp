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

/// Objects and table that push a piece of cloth.
///
/// Points press where they enter, and between them the facets of the cloth's surface where they are
/// deepest (contact/deepest.hpp), beyond a depth that on flat faces leaves all to the points. Both
/// press by soft springs at first. press_on() carries on the points' forces until they no longer
/// enter (augmented Lagrangian, Hestenes 1969), and stiffens all springs, for stiff ones
/// from the start on make a descent's steps short. What lies beside a pin is left out: two pins on
/// a round body hold the cloth between them inside it. On solids of sharp edges, whose normals turn
/// at once, points press alone.
///
/// Friction is elastic and plastic: each place that presses has a tangential spring that yields
/// at the coefficient times its push; settle() moves it, once per increment of load or of time, and
/// pushes and places stay those of the last settle() meanwhile, so that there is an energy.
class ObjectPushes : public Pushes {
 public:
  ObjectPushes(const MeshCloth& cloth, const std::vector<bool>& held,
               const Surroundings& surroundings, double friction, double gravity_m_per_s2);

  [[nodiscard]] double energy_j(const MeshCloth::State& state) override;
  void add_forces(const MeshCloth::State& state, MeshCloth::State& force) override;
  [[nodiscard]] std::vector<Support> supports(const MeshCloth::State& state) override;
  void settle(const MeshCloth::State& state) override;

  [[nodiscard]] bool holds() const { return friction_ > 0; }
  [[nodiscard]] bool is_firm() const;  ///< springs are as stiff as they become
  /// Largest distance of a pushed point from an object's surface, in or off it (m).
  [[nodiscard]] double off_surface_m(const MeshCloth::State& state);
  /// Lets points press as they do now where they enter no more, and makes all springs twice as
  /// stiff, up to the grid's.
  void press_on(const MeshCloth::State& state);
  /// Forces that press on the cloth: places of triangles by their corners; the fourth has no
  /// weight.
  [[nodiscard]] std::vector<ContactForce> stated(const MeshCloth::State& state);

  /// Adds what presses and holds in a state.
  void remember(const MeshCloth::State& state, ContactMemory& memory);
  /// Goes on from what the same cloth remembers, of this mesh or another, in a state of this one:
  /// each place takes over what the nearest one on the same shape bore.
  void take_over(const ContactMemory& memory, const MeshCloth::State& own);

 private:
  struct Push {
    int site = 0;               ///< point or facet behind the points, times shapes, plus shape
    std::array<int, 3> node{};  ///< nodes of the surface
    Eigen::Vector3d weight = Eigen::Vector3d::UnitX(), place, normal;
    double stiffness = 0, depth_m = 0;  ///< with what is carried on: the force is their product

    [[nodiscard]] double force_n() const { return stiffness * depth_m; }
  };
  /// A tangential spring.
  struct Grip {
    int site = 0;
    std::array<int, 3> node{};
    Eigen::Vector3d weight, place, normal;  ///< as when it was settled
    Eigen::Vector3d stretch;                ///< then (m)
    double limit_n = 0;
  };
  void look(const MeshCloth::State& state);
  void look_at_facets(int shape);
  [[nodiscard]] Eigen::Vector3d stretch_of(const Grip& grip) const;
  [[nodiscard]] Eigen::Vector3d friction_of(const Grip& grip) const;
  void add_support(int site, const Eigen::Vector3d& weight, const Eigen::Matrix3d& stiffness,
                   std::vector<Support>& found) const;
  [[nodiscard]] Eigen::Vector2d material_of(const std::array<int, 3>& node,
                                            const Eigen::Vector3d& weight) const;
  [[nodiscard]] Eigen::Vector3d mix(const std::array<int, 3>& node,
                                    const Eigen::Vector3d& weight) const;

  const MeshCloth& cloth_;
  const std::vector<bool>& held_;
  const Surroundings& surroundings_;
  ClothSurface surface_;
  double friction_, stiffness_, grip_stiffness_, firmness_ = 1;
  std::vector<bool> between_;      ///< for each shape, whether facets press on it
  std::vector<double> carried_n_;  ///< by points, of their sites
  std::vector<Grip> grips_;
  MeshCloth::State seen_, nodes_;  ///< the state looked at last, and its surface
  std::vector<double> gap_;        ///< distances of the nodes to a shape
  std::vector<Push> pushes_;
};

}  // namespace drape::simulate

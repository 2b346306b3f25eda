// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "simulate/fabric/laws.hpp"
#include "simulate/mesh/four.hpp"
#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

/// The cloth of Cloth (model `consistent`) on a triangle mesh: the same energy per area of the same
/// curves, so both have one limit,
///   tensile_warp(|x_u| - 1) + tensile_weft(|x_v| - 1) + shear(angle of x_u and x_v)
///   + bending_warp(|x_uu|) + bending_weft(|x_vv|) + twist / 2 |x_uv|^2,
/// u along the warp, v along the weft. First derivatives are those of the linear triangle. Stretch
/// and shear are taken at the points, from the mean metric of the triangles around (nodal
/// integration: Dohrmann et al. 2000): two triangles to a point, each with two stiff strains, would
/// lock where cloth hardly stretches. A twentieth stays with each triangle, so that no motion
/// between neighbours is free (Puso and Solberg 2006). Second derivatives are those of Morley's
/// triangle (Morley 1968), for each coordinate: quadratic, given by its values at the corners and
/// its derivative along the normal in the middle of each side. Alone it is too soft: a wave of
/// wavenumber k bends with 1 - 0.14 (k h)^2 of its energy at spacing h. Two triangles then differ
/// in the second derivative along their common side; twice the bending energy of that difference,
/// by the curves' first slopes over a third of both areas, leaves 0.005 to 0.02 (k h)^2. Constant
/// strain and constant curvature are exact on any mesh (patch tests), and so it converges. The
/// derivatives of the sides are unknowns of their own.
///
/// A state holds the points (m), then one vector per side: the derivative of the position along the
/// side's normal, which points to the side's left (from `from` to `to`).
class MeshCloth {
 public:
  using State = std::vector<Eigen::Vector3d>;

  /// `in_triangles`: fraction (0 to 1) of stretch and shear that stays with the triangles; the
  /// twentieth is Puso and Solberg's (2006). 1 makes plain linear triangles, which lock: for
  /// comparisons with other programs, as the paper's Fig. 4. Internal friction stays at the points.
  MeshCloth(MaterialMesh mesh, ClothLaws laws, double in_triangles = 0.05);

  [[nodiscard]] const MaterialMesh& mesh() const { return mesh_; }
  [[nodiscard]] int points() const { return static_cast<int>(mesh_.points_m.size()); }
  [[nodiscard]] int unknowns() const { return points() + static_cast<int>(mesh_.edges.size()); }
  [[nodiscard]] const std::vector<double>& mass_kg() const { return mass_; }  ///< by point

  /// The elements, so that a solver can form second derivatives of its own.
  struct Triangle {
    std::array<int, 3> corner;
    std::array<int, 6> unknown;  ///< corners, then sides
    double area = 0;
    std::array<double, 3> d_u, d_v;          ///< gradients of the linear triangle
    std::array<double, 6> d_uu, d_uv, d_vv;  ///< weights of Morley's
  };
  /// A side between two triangles.
  struct Seam {
    std::array<int, 12> unknown;    ///< in the triangle on the left, then in that on the right
    std::array<double, 12> weight;  ///< weights of the difference of second derivatives along it
    double stiffness = 0;           ///< N m^3
  };
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<Seam>& seams() const { return seams_; }
  [[nodiscard]] const ClothLaws& laws() const { return laws_; }
  [[nodiscard]] double in_triangles() const { return in_triangles_; }
  [[nodiscard]] const std::vector<double>& area_m2() const { return area_; }  ///< by point
  /// Unit vector in material coordinates, to the side's left.
  [[nodiscard]] Eigen::Vector2d normal_of(int edge) const;
  /// Mean over the triangles at each point of (|x_u|^2, x_u . x_v, |x_v|^2).
  [[nodiscard]] std::vector<Eigen::Vector3d> metrics(const State& state) const;

  /// Stiffness (N m) of each triangle along warp and weft in a state: the steeper of tangent and
  /// secant, and the friction elements' tangent.
  [[nodiscard]] std::vector<std::array<double, 2>> bending_stiffness(const State& state) const;

  /// State of a smooth map: position and its derivatives along warp and weft at a material point.
  struct Jet {
    Eigen::Vector3d x, x_u, x_v;
  };
  template <class Map>
  [[nodiscard]] State state_of(const Map& map) const {
    State state;
    for (const Eigen::Vector2d& p : mesh_.points_m) state.push_back(map(p).x);
    for (std::size_t e = 0; e < mesh_.edges.size(); ++e) {
      const Jet jet = map(middle_of(static_cast<int>(e)));
      const Eigen::Vector2d n = normal_of(static_cast<int>(e));
      state.push_back(jet.x_u * n.x() + jet.x_v * n.y());
    }
    return state;
  }

  /// Internal friction, as Cloth has it; slips of bending by triangle, of shear by point.
  [[nodiscard]] const ClothMemory& memory() const { return memory_; }
  /// Goes on from a memory of this mesh.
  void remember(ClothMemory memory) { memory_ = std::move(memory); }
  double settle(const State& state);
  /// Takes over what each friction element of the same cloth on another mesh bears, from the
  /// nearest there to the nearest here.
  void take_over(const MeshCloth& other, const State& of_other, const State& own);
  [[nodiscard]] double dissipated_j() const { return dissipated_j_; }

  [[nodiscard]] InternalEnergies energies(const State& state) const;
  /// Adds minus the energy's gradient (N; N m for the sides) and returns the energies.
  InternalEnergies add_forces(const State& state, State& force) const;

 private:
  friend class ClothTangent;
  /// Takes from the forces what the seams pull; returns their energy.
  DRAPE_WIDE static double pull_seams(const std::vector<Seam>& seams, const Four* x, Four* force);
  [[nodiscard]] Seam seam_of(int edge) const;
  [[nodiscard]] Eigen::Vector2d middle_of(int edge) const;
  template <class Visit>
  void visit_bending_friction(const State& state, Visit visit) const;
  void add_friction_forces(const State& state, State& force, InternalEnergies& sum) const;

  MaterialMesh mesh_;
  ClothLaws laws_;
  double in_triangles_;
  std::vector<Triangle> triangles_;
  std::vector<Seam> seams_;
  std::vector<double> mass_, area_;  ///< by point
  ClothMemory memory_;
  double dissipated_j_ = 0;
};

/// Second derivative of a MeshCloth's energy at a state; curves of straight pieces and friction
/// elements by their tangent. The cloth must outlive it and keep its memory.
class ClothTangent {
 public:
  ClothTangent(const MeshCloth& cloth, const MeshCloth::State& state);
  /// Adds its product with a direction (N; N m for the sides).
  void add_products(const MeshCloth::State& direction, MeshCloth::State& product) const;

  struct Element {
    Four u, v, stress;          ///< slopes; derivatives of the energy (J) to the metric
    Four change[3];             ///< of the triangle's own stress, by each entry of the metric
    Four bent[2];               ///< unit vectors of curvature along warp and weft
    double secant[2], rise[2];  ///< bending stiffness (N m^3) across them; more along them
  };

 private:
  void add_friction_products(const MeshCloth::State& direction, MeshCloth::State& product) const;

  const MeshCloth& cloth_;
  MeshCloth::State state_;  ///< only with internal friction
  std::vector<Element> elements_;
  mutable Fours at_points_;  ///< three for each point, as Element::change
};

}  // namespace drape::simulate

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

/// Cloth on a triangle mesh. Its energy per area follows from the measured curves,
///   tensile_warp(|x_u| - 1) + tensile_weft(|x_v| - 1) + shear(angle of x_u and x_v)
///   + bending_warp(|x_uu|) + bending_weft(|x_vv|) + twist / 2 |x_uv|^2,
/// with u along the warp and v along the weft. First derivatives are those of the linear
/// triangle. Stretch and shear are evaluated at the points, from the mean metric of the adjacent
/// triangles (nodal integration: Dohrmann et al. 2000): with two triangles per point, each with
/// two stiff strains, nearly inextensible cloth would lock. A twentieth is evaluated per
/// triangle, to suppress zero-energy modes (Puso and Solberg 2006). Second derivatives are those
/// of Morley's triangle (Morley 1968) for each coordinate: quadratic, defined by the values at
/// the corners and the normal derivative at the midpoint of each side. Alone it is too soft: a
/// wave of wavenumber k has 1 - 0.14 (k h)^2 of its bending energy at spacing h. The two
/// triangles at a side then differ in the second derivative along it; adding twice the bending
/// energy of this difference, with the curves' first slopes, over a third of both areas, leaves
/// an error of 0.005 to 0.02 (k h)^2. Constant strain and constant curvature are exact on any
/// mesh (patch tests), which implies convergence. The normal derivatives of the sides are
/// unknowns of their own.
///
/// A state holds the points (m), then one vector per side: the derivative of the position along
/// the side's normal, which points to the left of the side (from `from` to `to`).
class MeshCloth {
 public:
  using State = std::vector<Eigen::Vector3d>;

  /// `in_triangles`: fraction (0 to 1) of stretch and shear evaluated per triangle; the twentieth
  /// is from Puso and Solberg (2006). 1 gives plain linear triangles, which lock, for comparison
  /// with other programs as in the paper's Fig. 4. Internal friction is evaluated at the points.
  MeshCloth(MaterialMesh mesh, ClothLaws laws, double in_triangles = 0.05);

  [[nodiscard]] const MaterialMesh& mesh() const { return mesh_; }
  [[nodiscard]] int points() const { return static_cast<int>(mesh_.points_m.size()); }
  [[nodiscard]] int unknowns() const { return points() + static_cast<int>(mesh_.edges.size()); }
  [[nodiscard]] const std::vector<double>& mass_kg() const { return mass_; }  ///< per point

  /// The elements, for solvers that form second derivatives themselves.
  struct Triangle {
    std::array<int, 3> corner;
    std::array<int, 6> unknown;  ///< corners, then sides
    double area = 0;
    std::array<double, 3> d_u, d_v;          ///< gradients of the linear shape functions
    std::array<double, 6> d_uu, d_uv, d_vv;  ///< second derivatives of Morley's shape functions
  };
  /// A side shared by two triangles.
  struct Seam {
    std::array<int, 12> unknown;    ///< left triangle first, then the right one
    std::array<double, 12> weight;  ///< weights of the jump of the second derivative along the side
    double stiffness = 0;           ///< N m^3
  };
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<Seam>& seams() const { return seams_; }
  [[nodiscard]] const ClothLaws& laws() const { return laws_; }
  [[nodiscard]] double in_triangles() const { return in_triangles_; }
  [[nodiscard]] const std::vector<double>& area_m2() const { return area_; }  ///< per point
  /// Unit normal in material coordinates, pointing to the side's left.
  [[nodiscard]] Eigen::Vector2d normal_of(int edge) const;
  /// Metric (|x_u|^2, x_u . x_v, |x_v|^2) at each point, averaged over its triangles.
  [[nodiscard]] std::vector<Eigen::Vector3d> metrics(const State& state) const;

  /// Bending stiffness (N m) of each triangle along warp and weft: the larger of tangent and
  /// secant, plus the tangent of the friction elements.
  [[nodiscard]] std::vector<std::array<double, 2>> bending_stiffness(const State& state) const;

  /// Position and its derivatives along warp and weft at a material point, to define a state.
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

  /// State of internal friction: slips of bending per triangle, of shear per point.
  [[nodiscard]] const ClothMemory& memory() const { return memory_; }
  /// Restores a state of internal friction of this mesh.
  void remember(ClothMemory memory) { memory_ = std::move(memory); }
  double settle(const State& state);
  /// Transfers the forces of friction elements from another mesh of the same cloth, between nearest
  /// elements.
  void take_over(const MeshCloth& other, const State& of_other, const State& own);
  [[nodiscard]] double dissipated_j() const { return dissipated_j_; }

  [[nodiscard]] InternalEnergies energies(const State& state) const;
  /// Adds the negative gradient of the energy (N; N m for the sides) and returns the energies.
  InternalEnergies add_forces(const State& state, State& force) const;

 private:
  friend class ClothTangent;
  /// Subtracts the forces of the seams; returns their energy.
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
  std::vector<double> mass_, area_;  ///< per point
  ClothMemory memory_;
  double dissipated_j_ = 0;
};

/// Second derivative of a MeshCloth's energy at a state, with tangents for piecewise linear curves
/// and friction elements. The cloth must outlive it and keep its memory.
class ClothTangent {
 public:
  ClothTangent(const MeshCloth& cloth, const MeshCloth::State& state);
  /// Adds the product with a direction (N; N m for the sides).
  void add_products(const MeshCloth::State& direction, MeshCloth::State& product) const;

  struct Element {
    Four u, v, stress;          ///< slopes; derivatives of the energy (J) by the metric
    Four change[3];             ///< triangle's own stress, by entry of the metric
    Four bent[2];               ///< unit curvature vectors along warp and weft
    double secant[2], rise[2];  ///< bending stiffness (N m^3) across them; its increase along them
  };

 private:
  void add_friction_products(const MeshCloth::State& direction, MeshCloth::State& product) const;

  const MeshCloth& cloth_;
  MeshCloth::State state_;  ///< with internal friction only
  std::vector<Element> elements_;
  mutable Fours at_points_;  ///< three per point, as in Element::change
};

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "simulate/fabric/laws.hpp"
#include "simulate/mesh/material_mesh.hpp"

// Builds the inner loops twice. The wider version performs the same operations on each element
// (neither may use fused multiply-add), so results do not depend on the processor.

// The arrays in these loops do not overlap, which the compiler cannot prove.
#if defined(__GNUC__) && !defined(__clang__)
#define DRAPE_INDEPENDENT _Pragma("GCC ivdep")
#define DRAPE_INLINE __attribute__((always_inline)) inline
#else
#define DRAPE_INDEPENDENT
#define DRAPE_INLINE inline
#endif

// Built twice; selected at run time by the processor.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DRAPE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define DRAPE_WIDE
#endif

namespace drape::simulate {

/// Three coordinates and a zero, in one or two registers; a double* may point into it.
using Four = double __attribute__((vector_size(32), aligned(8), may_alias));

[[nodiscard]] DRAPE_INLINE double dot(const Four& a, const Four& b) {
  const Four product = a * b;
  return product[0] + product[1] + product[2];
}

/// Sets the weighted sum of `x` at `N` unknowns.
template <std::size_t N, class Weights, class Unknowns>
DRAPE_INLINE void set_sum(Four& sum, const Weights& weight, const Unknowns& unknown,
                          const Four* x) {
  sum = weight[0] * x[unknown[0]];
#pragma GCC unroll 12
  for (std::size_t k = 1; k < N; ++k) sum += weight[k] * x[unknown[k]];
}

/// An array of `count` vectors, initially zero.
class Fours {
 public:
  Fours() = default;
  explicit Fours(std::size_t count) : values_(4 * count, 0.0) {}
  [[nodiscard]] Four* data() { return reinterpret_cast<Four*>(values_.data()); }
  [[nodiscard]] Four& operator[](std::size_t i) { return data()[i]; }
  void set(std::size_t i, const Eigen::Vector3d& vector) {
    for (int k = 0; k < 3; ++k) values_[4 * i + k] = vector[k];
  }
  [[nodiscard]] Eigen::Map<const Eigen::Vector3d> at(std::size_t i) const {
    return Eigen::Map<const Eigen::Vector3d>(values_.data() + 4 * i);
  }

 private:
  std::vector<double> values_;
};

/// Weighted sum of a state's vectors at the first N of the given unknowns.
template <std::size_t N, std::size_t M>
[[nodiscard]] Eigen::Vector3d combined(const std::array<double, N>& weight,
                                       const std::array<int, M>& unknown,
                                       const std::vector<Eigen::Vector3d>& state) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < N; ++k) sum += weight[k] * state[unknown[k]];
  return sum;
}

/// Metric (|x_u|^2, x_u . x_v, |x_v|^2).
[[nodiscard]] inline Eigen::Vector3d metric_of(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  return {u.squaredNorm(), u.dot(v), v.squaredNorm()};
}

/// Stretches and shear angle of a metric.
struct MetricStrain {
  double a, b, sine;

  explicit MetricStrain(const Eigen::Vector3d& metric)
      : a(std::sqrt(std::max(metric[0], 1e-30))),
        b(std::sqrt(std::max(metric[2], 1e-30))),
        sine(std::clamp(metric[1] / (a * b), -1.0, 1.0)) {}
  [[nodiscard]] double angle() const { return std::asin(sine); }
  [[nodiscard]] double cosine() const { return std::max(std::sqrt(1 - sine * sine), 1e-9); }
  /// Derivatives by the metric of an energy with this moment per shear angle.
  [[nodiscard]] Eigen::Vector3d of_angle(double moment) const {
    return moment / cosine() *
           Eigen::Vector3d(-sine / (2 * a * a), 1 / (a * b), -sine / (2 * b * b));
  }
};

/// Derivatives of the membrane's energy per area by the metric, for a strain and its shear angle.
[[nodiscard]] inline Eigen::Vector3d stress_of(const MetricStrain& strain, double angle,
                                               const ClothLaws& laws) {
  return strain.of_angle(laws.shear.odd_value(angle)) +
         Eigen::Vector3d(laws.tensile[0].value(strain.a - 1) / (2 * strain.a), 0,
                         laws.tensile[1].value(strain.b - 1) / (2 * strain.b));
}

/// A curvature vector c projected on the normal of the sheet, n = a x b / |a x b|, with tangents a
/// and b. Unlike |c| it has the sign that friction elements need, and it rotates with the sheet.
struct NormalCurvature {
  double value = 0;
  Eigen::Vector3d of_c, of_a, of_b;  ///< gradient by c, a and b
};
[[nodiscard]] inline NormalCurvature normal_curvature(const Eigen::Vector3d& c,
                                                      const Eigen::Vector3d& a,
                                                      const Eigen::Vector3d& b) {
  const Eigen::Vector3d across = a.cross(b);
  const double size = std::max(across.norm(), 1e-12 * a.norm() * b.norm() + 1e-300);
  const Eigen::Vector3d n = across / size;
  const double value = c.dot(n);
  const Eigen::Vector3d of_across = (c - value * n) / size;
  return {value, n, b.cross(of_across), of_across.cross(a)};
}

/// Cloth on a triangle mesh. Its energy per area follows from the measured curves,
///   tensile_warp(|x_u| - 1) + tensile_weft(|x_v| - 1) + shear(angle of x_u and x_v)
///   + bending_warp(|x_uu|) + bending_weft(|x_vv|) + twist / 2 |x_uv|^2,
/// with u along the warp and v along the weft. First derivatives are those of the linear
/// triangle. Stretch and shear are evaluated at the points, from the mean metric of the
/// adjacent triangles (nodal integration: Dohrmann et al. 2000): with two triangles per point,
/// each with two stiff strains, nearly inextensible cloth would lock. A twentieth is evaluated
/// per triangle, to suppress zero-energy modes (Puso and Solberg 2006). Second derivatives are
/// those of Morley's triangle (Morley 1968) for each coordinate: quadratic, defined by the
/// values at the corners and the normal derivative at the midpoint of each edge. Alone it is
/// too soft: a wave of wavenumber k has 1 - 0.14 (k h)^2 of its bending energy at spacing h,
/// and the second derivative along an edge jumps between its two triangles. Adding twice the
/// bending energy of this jump, with the curves' first slopes, over a third of both areas,
/// leaves an error of 0.005 to 0.02 (k h)^2. Constant strain and constant curvature are exact
/// on any mesh (patch tests), which implies convergence. The normal derivatives at the edges
/// are separate unknowns.
///
/// A state holds the points (m), then one vector per edge: the derivative of the position along
/// the edge's normal, which points to the left of the edge (from `from` to `to`).
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
    std::array<int, 6> unknown;  ///< corners, then edges
    double area = 0;
    std::array<double, 3> d_u, d_v;          ///< gradients of the linear shape functions
    std::array<double, 6> d_uu, d_uv, d_vv;  ///< second derivatives of Morley's shape functions
  };
  /// An edge shared by two triangles.
  struct Seam {
    std::array<int, 12> unknown;    ///< left triangle first, then the right one
    std::array<double, 12> weight;  ///< weights of the jump of the second derivative along the edge
    double stiffness = 0;           ///< N m^3
  };
  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  [[nodiscard]] const std::vector<Seam>& seams() const { return seams_; }
  [[nodiscard]] const ClothLaws& laws() const { return laws_; }
  [[nodiscard]] double in_triangles() const { return in_triangles_; }
  [[nodiscard]] const std::vector<double>& area_m2() const { return area_; }  ///< per point
  /// Material coordinates of a point, or of the midpoint of the edge that is an unknown.
  [[nodiscard]] Eigen::Vector2d material_m(int unknown) const;
  /// Unit normal in material coordinates, pointing to the edge's left.
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
      const Jet jet = map(material_m(points() + static_cast<int>(e)));
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
  /// Adds the negative gradient of the energy (N; N m for the edges) and returns the energies.
  InternalEnergies add_forces(const State& state, State& force) const;

 private:
  friend class ClothTangent;
  /// Subtracts the forces of the seams; returns their energy.
  DRAPE_WIDE static double pull_seams(const std::vector<Seam>& seams, const Four* x, Four* force);
  [[nodiscard]] Seam seam_of(int edge) const;
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

/// Hessian of a MeshCloth's energy at a state, with tangents for piecewise linear curves and
/// friction elements. The cloth must outlive it and keep its friction state.
class ClothTangent {
 public:
  ClothTangent(const MeshCloth& cloth, const MeshCloth::State& state);
  /// Adds the product with a direction (N; N m for the edges).
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

/// Four facets per triangle, by nodes: the points, then the midpoint of each edge.
[[nodiscard]] std::vector<std::array<int, 3>> facets_of(const MaterialMesh& mesh);

/// ASCII PLY, in mm, of points in the world and faces; `uv` holds texture coordinates, empty or one
/// per point.
[[nodiscard]] std::string ply_text(const std::string& comment, const MeshCloth::State& points_m,
                                   const std::vector<Eigen::Vector2d>& uv,
                                   const std::vector<std::array<int, 3>>& faces);

/// Surface of a MeshCloth between its points: each triangle is divided into four flat facets at its
/// edge midpoints. A midpoint is the mean of the quadratics of the adjacent triangles, which leaves
/// a quarter of the distance between chord and curved cloth. The surface touches objects and is
/// written to files; the checker builds it with independent code.
///
/// Nodes are numbered like the unknowns: the points, then one per edge.
class ClothSurface {
 public:
  explicit ClothSurface(const MeshCloth& cloth);

  /// As facets_of(); facet f belongs to triangle f / 4.
  [[nodiscard]] const std::vector<std::array<int, 3>>& facets() const { return facets_; }
  /// Positions of all nodes (m).
  [[nodiscard]] MeshCloth::State nodes(const MeshCloth::State& state) const;
  void find_nodes(const MeshCloth::State& state, MeshCloth::State& places) const;
  /// Converts forces (N) on the nodes, or on the points only, to forces on the unknowns and adds
  /// them (N; N m for the edges).
  void add_forces(const MeshCloth::State& on_nodes, MeshCloth::State& force) const;
  /// Position of one node (m).
  [[nodiscard]] Eigen::Vector3d place(const MeshCloth::State& state, int node) const;
  void add_force(int node, const Eigen::Vector3d& on_node, MeshCloth::State& force) const;
  /// Weights of the triangle's corners at a point of a facet. The facet's corners are the
  /// triangle's corners or edge midpoints.
  [[nodiscard]] std::array<double, 3> corner_weights(int facet,
                                                     const Eigen::Vector3d& weights) const;
  /// Weights of the edges' unknowns at the midpoint of an edge.
  [[nodiscard]] std::vector<std::pair<int, double>> side_weights(int side) const;

 private:
  const MeshCloth& cloth_;
  std::vector<std::array<int, 3>> facets_;
  std::vector<std::pair<int, double>> middle_;  ///< weights of unknowns, for all edges in turn
  std::vector<std::size_t> begin_ = {0};        ///< index of each edge's first weight
};

/// Sum of second derivatives of point energies on a surface, for products with directions.
class SurfaceProducts {
 public:
  void clear();
  /// Adds the energy of a point, a weighted sum of nodes, given its second derivative (N/m).
  void add(const std::array<int, 4>& nodes, const std::array<double, 4>& weights,
           const Eigen::Matrix3d& second);
  /// Adds the energy of four nodes.
  void add(const std::array<int, 4>& nodes, const Eigen::Matrix<double, 12, 12>& second);
  void add_products(const ClothSurface& surface, const MeshCloth::State& direction,
                    MeshCloth::State& product) const;

 private:
  struct Mixed {
    std::array<int, 4> node;  ///< indices into nodes_
    std::array<double, 4> weight;
    Eigen::Matrix3d second;
  };
  struct Whole {
    std::array<int, 4> node;
    Eigen::Matrix<double, 12, 12> second;
  };
  [[nodiscard]] std::array<int, 4> numbers_of(const std::array<int, 4>& nodes);

  std::vector<Mixed> mixed_;
  std::vector<Whole> whole_;
  std::vector<int> nodes_, number_;  ///< index by node, -1 if not in nodes_
};

}  // namespace drape::simulate

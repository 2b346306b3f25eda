// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// Four facets per triangle, by nodes: the points, then the midpoint of each side.
[[nodiscard]] std::vector<std::array<int, 3>> facets_of(const MaterialMesh& mesh);

/// ASCII PLY, in mm, of points in the world and faces; `uv` holds texture coordinates, empty or one
/// per point.
[[nodiscard]] std::string ply_text(const std::string& comment, const MeshCloth::State& points_m,
                                   const std::vector<Eigen::Vector2d>& uv,
                                   const std::vector<std::array<int, 3>>& faces);

/// Surface of a MeshCloth between its points: each triangle is divided into four flat facets at the
/// midpoints of its sides. A midpoint is placed at the mean of the quadratics of the adjacent
/// triangles, which leaves a quarter of the distance between chord and curved cloth. The surface
/// touches objects and is written to files; the checker builds it with independent code.
///
/// Nodes are numbered like the unknowns: the points, then one per side.
class ClothSurface {
 public:
  explicit ClothSurface(const MeshCloth& cloth);

  /// As facets_of(); facet f belongs to triangle f / 4.
  [[nodiscard]] const std::vector<std::array<int, 3>>& facets() const { return facets_; }
  /// Positions of all nodes (m).
  [[nodiscard]] MeshCloth::State nodes(const MeshCloth::State& state) const;
  void find_nodes(const MeshCloth::State& state, MeshCloth::State& places) const;
  /// Converts forces (N) on the nodes, or on the points only, to forces on the unknowns and adds
  /// them (N; N m for the sides).
  void add_forces(const MeshCloth::State& on_nodes, MeshCloth::State& force) const;
  /// Position of one node (m).
  [[nodiscard]] Eigen::Vector3d place(const MeshCloth::State& state, int node) const;
  void add_force(int node, const Eigen::Vector3d& on_node, MeshCloth::State& force) const;
  /// Weights of the triangle's corners for a place on a facet, whose own corners are those of the
  /// triangle or midpoints between them.
  [[nodiscard]] std::array<double, 3> corner_weights(int facet,
                                                     const Eigen::Vector3d& weights) const;
  /// Weights of the sides' unknowns at the same place.
  [[nodiscard]] std::vector<std::pair<int, double>> side_weights(
      int facet, const Eigen::Vector3d& weights) const;

  /// Weights of the sides' unknowns at the midpoint of a side.
  [[nodiscard]] std::vector<std::pair<int, double>> side_weights(int side) const;

 private:
  const MeshCloth& cloth_;
  std::vector<std::array<int, 3>> facets_;
  std::vector<std::pair<int, double>> middle_;  ///< weights of unknowns, for all sides in turn
  std::vector<std::size_t> begin_ = {0};        ///< index of each side's first weight
};

/// Sum of second derivatives of energies of places on a surface, for products with directions.
class SurfaceProducts {
 public:
  void clear();
  [[nodiscard]] bool empty() const { return mixed_.empty() && whole_.empty(); }
  /// Adds the energy of a place, a weighted sum of nodes, given its second derivative (N/m).
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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simulate/mesh/mesh_cloth.hpp"

namespace drape::simulate {

/// Four facets to a triangle, by nodes: the points, then the middle of each side.
[[nodiscard]] std::vector<std::array<int, 3>> facets_of(const MaterialMesh& mesh);

/// ASCII PLY in mm of points in the world and faces; `uv`, empty or one per point, as texture
/// coordinates.
[[nodiscard]] std::string ply_text(const std::string& comment, const MeshCloth::State& points_m,
                                   const std::vector<Eigen::Vector2d>& uv,
                                   const std::vector<std::array<int, 3>>& faces);

/// The surface of a MeshCloth between its points: each triangle cut in four flat facets at the
/// middles of its sides. A middle lies where the quadratics of the triangles beside the side put it
/// in the mean, a quarter of what the chord is off the curved cloth is left. Objects touch it, it
/// is what is written, and the checker finds it by code of its own.
///
/// Its nodes are numbered as the unknowns: the points, then one per side.
class ClothSurface {
 public:
  explicit ClothSurface(const MeshCloth& cloth);

  /// As facets_of(); facet f is of triangle f / 4.
  [[nodiscard]] const std::vector<std::array<int, 3>>& facets() const { return facets_; }
  /// Places of all nodes (m).
  [[nodiscard]] MeshCloth::State nodes(const MeshCloth::State& state) const;
  void find_nodes(const MeshCloth::State& state, MeshCloth::State& places) const;
  /// Adds what forces (N) on the nodes, or on the points alone, do to the unknowns (N; N m for the
  /// sides).
  void add_forces(const MeshCloth::State& on_nodes, MeshCloth::State& force) const;
  /// The same of one node.
  [[nodiscard]] Eigen::Vector3d place(const MeshCloth::State& state, int node) const;
  void add_force(int node, const Eigen::Vector3d& on_node, MeshCloth::State& force) const;
  /// Weights of the triangle's corners that name a place of a facet, whose own corners are the
  /// triangle's or halves of two.
  [[nodiscard]] std::array<double, 3> corner_weights(int facet,
                                                     const Eigen::Vector3d& weights) const;
  /// Weights of the sides' unknowns in the same place.
  [[nodiscard]] std::vector<std::pair<int, double>> side_weights(
      int facet, const Eigen::Vector3d& weights) const;

  /// Weights of the sides' unknowns in the middle of a side.
  [[nodiscard]] std::vector<std::pair<int, double>> side_weights(int side) const;

 private:
  const MeshCloth& cloth_;
  std::vector<std::array<int, 3>> facets_;
  std::vector<std::pair<int, double>> middle_;  ///< weights of the sides, of unknowns
  std::vector<std::size_t> begin_ = {0};        ///< first weight of each side
};

/// Sum of second derivatives of energies by places of a surface, for products with directions.
class SurfaceProducts {
 public:
  void clear();
  [[nodiscard]] bool empty() const { return mixed_.empty() && whole_.empty(); }
  /// Energy of the place that weights mix of nodes, with its second derivative (N/m).
  void add(const std::array<int, 4>& nodes, const std::array<double, 4>& weights,
           const Eigen::Matrix3d& second);
  /// Energy of four nodes.
  void add(const std::array<int, 4>& nodes, const Eigen::Matrix<double, 12, 12>& second);
  void add_products(const ClothSurface& surface, const MeshCloth::State& direction,
                    MeshCloth::State& product) const;

 private:
  struct Mixed {
    std::array<int, 4> node;  ///< numbers in nodes_
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
  std::vector<int> nodes_, number_;  ///< number_ by node, -1: not in nodes_
};

}  // namespace drape::simulate

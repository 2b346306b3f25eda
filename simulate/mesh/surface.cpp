// SPDX-License-Identifier: Apache-2.0
#include "simulate/mesh/surface.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/units.hpp"

namespace drape::simulate {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<std::array<int, 3>> facets_of(const MaterialMesh& mesh) {
  const auto points = static_cast<int>(mesh.points_m.size());
  std::vector<std::array<int, 3>> facets;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::array<int, 3>& corner = mesh.triangles[t];
    std::array<int, 3> middle = mesh.edges_of[t];  // midpoint opposite each corner
    for (int& m : middle) m += points;
    for (int k = 0; k < 3; ++k)
      facets.push_back({corner[k], middle[(k + 2) % 3], middle[(k + 1) % 3]});
    facets.push_back(middle);
  }
  return facets;
}

std::string ply_text(const std::string& comment, const MeshCloth::State& points_m,
                     const std::vector<Vector2d>& uv,
                     const std::vector<std::array<int, 3>>& faces) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment {}\nelement vertex {}\n"
      "property double x\nproperty double y\nproperty double z\n{}element face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      comment, points_m.size(), uv.empty() ? "" : "property double u\nproperty double v\n",
      faces.size());
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    const Vector3d p = points_m[i] / units::mm;
    text += fmt::format("{:.6f} {:.6f} {:.6f}", p.x(), p.y(), p.z());
    if (!uv.empty()) text += fmt::format(" {:.9f} {:.9f}", uv[i].x(), uv[i].y());
    text += '\n';
  }
  for (const auto& face : faces) text += fmt::format("3 {} {} {}\n", face[0], face[1], face[2]);
  return text;
}

ClothSurface::ClothSurface(const MeshCloth& cloth)
    : cloth_(cloth), facets_(facets_of(cloth.mesh())) {
  const MaterialMesh& mesh = cloth.mesh();
  for (const MaterialMesh::Edge& edge : mesh.edges) {
    const Vector2d d = mesh.points_m[edge.to] - mesh.points_m[edge.from];
    std::vector<std::pair<int, double>> weights = {{edge.from, 0.5}, {edge.to, 0.5}};
    const auto add = [&](int unknown, double weight) {
      const auto at = std::find_if(weights.begin(), weights.end(),
                                   [&](const auto& w) { return w.first == unknown; });
      if (at == weights.end())
        weights.emplace_back(unknown, weight);
      else
        at->second += weight;
    };
    const double beside = edge.left >= 0 && edge.right >= 0 ? 2 : 1;
    for (const int triangle : {edge.left, edge.right}) {
      if (triangle < 0) continue;
      const MeshCloth::Triangle& t = cloth.triangles()[triangle];
      for (int k = 0; k < 6; ++k)
        add(t.unknown[k], -(d.x() * d.x() * t.d_uu[k] + 2 * d.x() * d.y() * t.d_uv[k] +
                            d.y() * d.y() * t.d_vv[k]) /
                              (8 * beside));
    }
    middle_.insert(middle_.end(), weights.begin(), weights.end());
    begin_.push_back(middle_.size());
  }
}

MeshCloth::State ClothSurface::nodes(const MeshCloth::State& state) const {
  MeshCloth::State places;
  find_nodes(state, places);
  return places;
}

void ClothSurface::find_nodes(const MeshCloth::State& state, MeshCloth::State& places) const {
  places.resize(state.size());
  for (int node = 0; node < std::ssize(state); ++node) places[node] = place(state, node);
}

Vector3d ClothSurface::place(const MeshCloth::State& state, int node) const {
  const int side = node - cloth_.points();
  if (side < 0) return state[node];
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = begin_[side]; k < begin_[side + 1]; ++k)
    sum += middle_[k].second * state[middle_[k].first];
  return sum;
}

void ClothSurface::add_force(int node, const Vector3d& on_node, MeshCloth::State& force) const {
  const int side = node - cloth_.points();
  if (side < 0) {
    force[node] += on_node;
    return;
  }
  for (std::size_t k = begin_[side]; k < begin_[side + 1]; ++k)
    force[middle_[k].first] += middle_[k].second * on_node;
}

void ClothSurface::add_forces(const MeshCloth::State& on_nodes, MeshCloth::State& force) const {
  for (int node = 0; node < std::ssize(on_nodes); ++node)
    if (!on_nodes[node].isZero(0)) add_force(node, on_nodes[node], force);
}

std::array<double, 3> ClothSurface::corner_weights(int facet, const Vector3d& weights) const {
  const std::array<int, 6>& unknown = cloth_.triangles()[facet / 4].unknown;
  std::array<double, 3> sum{};
  for (int k = 0; k < 3; ++k) {
    const auto at = std::find(unknown.begin(), unknown.end(), facets_[facet][k]) - unknown.begin();
    for (int c = 0; c < 3; ++c) {
      if (at < 3)
        sum[c] += at == c ? weights[k] : 0;
      else
        sum[c] += at - 3 == c ? 0 : weights[k] / 2;
    }
  }
  return sum;
}

std::vector<std::pair<int, double>> ClothSurface::side_weights(int facet,
                                                               const Vector3d& weights) const {
  std::vector<std::pair<int, double>> sum;
  for (int k = 0; k < 3; ++k) {
    const int side = facets_[facet][k] - cloth_.points();
    if (side < 0) continue;
    for (std::size_t m = begin_[side]; m < begin_[side + 1]; ++m) {
      if (middle_[m].first < cloth_.points()) continue;
      const auto at = std::find_if(sum.begin(), sum.end(),
                                   [&](const auto& of) { return of.first == middle_[m].first; });
      const double weight = weights[k] * middle_[m].second;
      if (at == sum.end())
        sum.emplace_back(middle_[m].first, weight);
      else
        at->second += weight;
    }
  }
  return sum;
}

std::vector<std::pair<int, double>> ClothSurface::side_weights(int side) const {
  std::vector<std::pair<int, double>> weights;
  for (std::size_t m = begin_[side]; m < begin_[side + 1]; ++m)
    if (middle_[m].first >= cloth_.points()) weights.push_back(middle_[m]);
  return weights;
}

void SurfaceProducts::clear() {
  mixed_.clear();
  whole_.clear();
  for (const int node : nodes_) number_[node] = -1;
  nodes_.clear();
}

std::array<int, 4> SurfaceProducts::numbers_of(const std::array<int, 4>& nodes) {
  std::array<int, 4> numbers{};
  for (int k = 0; k < 4; ++k) {
    const auto node = static_cast<std::size_t>(nodes[k]);
    if (node >= number_.size()) number_.resize(node + 1, -1);
    if (number_[node] < 0) {
      number_[node] = static_cast<int>(nodes_.size());
      nodes_.push_back(nodes[k]);
    }
    numbers[k] = number_[node];
  }
  return numbers;
}

void SurfaceProducts::add(const std::array<int, 4>& nodes, const std::array<double, 4>& weights,
                          const Eigen::Matrix3d& second) {
  mixed_.push_back({numbers_of(nodes), weights, second});
}

void SurfaceProducts::add(const std::array<int, 4>& nodes,
                          const Eigen::Matrix<double, 12, 12>& second) {
  whole_.push_back({numbers_of(nodes), second});
}

void SurfaceProducts::add_products(const ClothSurface& surface, const MeshCloth::State& direction,
                                   MeshCloth::State& product) const {
  MeshCloth::State moved, on_nodes(nodes_.size(), Vector3d::Zero());
  for (const int node : nodes_) moved.push_back(surface.place(direction, node));
  for (const Mixed& of : mixed_) {
    Vector3d along = Vector3d::Zero();
    for (int k = 0; k < 4; ++k) along += of.weight[k] * moved[of.node[k]];
    along = of.second * along;
    for (int k = 0; k < 4; ++k) on_nodes[of.node[k]] += of.weight[k] * along;
  }
  Eigen::Matrix<double, 12, 1> four;
  for (const Whole& of : whole_) {
    for (int k = 0; k < 4; ++k) four.segment<3>(3 * k) = moved[of.node[k]];
    four = of.second * four;
    for (int k = 0; k < 4; ++k) on_nodes[of.node[k]] += four.segment<3>(3 * k);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    surface.add_force(nodes_[i], on_nodes[i], product);
}

}  // namespace drape::simulate

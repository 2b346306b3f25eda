// SPDX-License-Identifier: Apache-2.0
#include "simulate/ensemble/hem_label.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace drape::simulate {
namespace {

using Eigen::Vector2d;

constexpr double kFold = 3e-3;  // m; least prominence of a fold
constexpr int kHemSamples = 256;

/// Nodes of the surface along the hem in order: corners and the midpoints of the sides between
/// them.
std::vector<int> border_nodes(const MaterialMesh& mesh) {
  const std::vector<int> corners = border_of(mesh);
  std::vector<int> nodes;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const std::pair<int, int> ends = std::minmax({corners[k], corners[(k + 1) % corners.size()]});
    const auto side = std::lower_bound(mesh.edges.begin(), mesh.edges.end(), ends,
                                       [](const MaterialMesh::Edge& edge, const auto& key) {
                                         return std::pair(edge.from, edge.to) < key;
                                       });
    nodes.push_back(corners[k]);
    nodes.push_back(static_cast<int>(mesh.points_m.size()) +
                    static_cast<int>(side - mesh.edges.begin()));
  }
  return nodes;
}

/// Material coordinates of a node.
Vector2d material_of(const MaterialMesh& mesh, int node) {
  const auto points = static_cast<int>(mesh.points_m.size());
  if (node < points) return mesh.points_m[node];
  const MaterialMesh::Edge& edge = mesh.edges[node - points];
  return (mesh.points_m[edge.from] + mesh.points_m[edge.to]) / 2;
}

/// Number of maxima with a prominence of at least kFold on both sides.
int count_folds(const std::vector<double>& radius) {
  const auto n = static_cast<int>(radius.size());
  const auto value = [&](int i) { return radius[((i % n) + n) % n]; };
  int folds = 0;
  for (int i = 0; i < n; ++i) {
    if (value(i) <= value(i - 1) || value(i) < value(i + 1)) continue;
    double drop[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
      for (int k = 1; k < n; ++k) {
        const double other = value(side == 0 ? i - k : i + k);
        if (other > value(i)) break;
        drop[side] = std::max(drop[side], value(i) - other);
      }
    }
    folds += std::min(drop[0], drop[1]) > kFold;
  }
  return folds;
}

}  // namespace

HemLabel label_hem(const DrapeLevel& level, const ClothMoment& moment) {
  const MaterialMesh& mesh = level.cloth().mesh();
  const MeshCloth::State places = level.surface(moment);
  Vector2d middle = Vector2d::Zero();
  for (int i = 0; i < level.cloth().points(); ++i)
    middle += level.cloth().mass_kg()[i] / level.mass_kg() * places[i].head<2>();
  std::vector<int> nodes = border_nodes(mesh);
  nodes.push_back(nodes.front());
  std::vector<double> along_m = {0};  // material length up to each node
  for (std::size_t k = 1; k < nodes.size(); ++k)
    along_m.push_back(along_m.back() +
                      (material_of(mesh, nodes[k]) - material_of(mesh, nodes[k - 1])).norm());
  HemLabel label;
  std::vector<double> radius(kHemSamples);
  std::size_t next = 1;
  for (int k = 0; k < kHemSamples; ++k) {
    const double here_m = along_m.back() * k / kHemSamples;
    while (along_m[next] <= here_m) ++next;
    const double part = (here_m - along_m[next - 1]) / (along_m[next] - along_m[next - 1]);
    const Vector2d place =
        (1 - part) * places[nodes[next - 1]].head<2>() + part * places[nodes[next]].head<2>();
    radius[k] = (place - middle).norm();
  }
  for (std::size_t m = 0; m < label.amplitude_m.size(); ++m) {
    std::complex<double> sum = 0;
    for (int k = 0; k < kHemSamples; ++k)
      sum +=
          std::polar(radius[k], -2 * std::numbers::pi * static_cast<double>(m) * k / kHemSamples);
    label.amplitude_m[m] = (m == 0 ? 1.0 : 2.0) * std::abs(sum) / kHemSamples;
  }
  label.nodes = count_folds(radius);
  return label;
}

}  // namespace drape::simulate

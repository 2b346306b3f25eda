// SPDX-License-Identifier: Apache-2.0
#include "simulate/paper/paper_layers.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kSink_m = 2e-6;    // depth at which a pair carries a particle's weight
constexpr double kMargin_m = 1e-3;  // displacement of a particle after which pairs are listed again
constexpr double kDamped = 0.2;     // relative to critical damping
constexpr int kMostPairs = 12;      // simultaneous contacts of one particle

Nodes nodes_of(const Particles& x) {
  Nodes nodes;
  nodes.reserve(static_cast<std::size_t>(x.cols()));
  for (Eigen::Index i = 0; i < x.cols(); ++i) nodes.emplace_back(x.col(i));
  return nodes;
}

}  // namespace

PaperLayers::PaperLayers(const ParticleGrid& grid, double particle_kg, double gravity_m_per_s2,
                         double thickness_m)
    : thickness_(thickness_m),
      n_per_m_(particle_kg * gravity_m_per_s2 / kSink_m),
      damping_n_s_per_m_(2 * kDamped * std::sqrt(n_per_m_ * particle_kg)),
      per_kg_(1 / particle_kg) {
  std::vector<bool> owned(static_cast<std::size_t>(grid.count()), false);
  std::set<std::array<int, 2>> edges;
  std::vector<Vector3d> centres;
  const auto add = [&](const std::array<int, 3>& node) {
    Facet facet{node, {}, {}};
    Vector3d centre = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const int a = node[k], b = node[(k + 1) % 3];
      centre.head<2>() += grid.material_m(a) / 3;
      if (!owned[a]) facet.own.push_back(a);
      owned[a] = true;
      const std::array<int, 2> edge = {std::min(a, b), std::max(a, b)};
      if (edges.insert(edge).second) facet.edges.push_back(edge);
    }
    facets_.push_back(std::move(facet));
    centres.push_back(centre);
  };
  for (int i = 0; i + grid.cols + 1 < grid.count(); ++i) {
    if (i % grid.cols + 1 == grid.cols) continue;
    add({i, i + 1, i + grid.cols});
    add({i + 1, i + grid.cols + 1, i + grid.cols});
  }
  tree_ = BoxTree(centres);
}

void PaperLayers::offer(const LayerPair& pair, const Nodes& nodes) {
  const int firsts = pair.edges ? 2 : 1;
  for (int k = 0; k < firsts; ++k)
    for (int l = firsts; l < 4; ++l)
      if (pair.node[k] == pair.node[l]) return;
  if (!are_apart(pair, nodes, thickness_ + 2 * kMargin_m)) pairs_.push_back(pair);
}

void PaperLayers::follow(const Particles& x) {
  if (thickness_ <= 0) return;
  if (listed_.size() > 0 &&
      (x - listed_).colwise().squaredNorm().maxCoeff() < kMargin_m * kMargin_m)
    return;
  listed_ = x;
  const Nodes nodes = nodes_of(x);
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Facet& facet : facets_) {
    Eigen::AlignedBox3d box;
    for (const int i : facet.node) box.extend(nodes[i]);
    const double reach = thickness_ / 2 + kMargin_m;
    boxes.emplace_back(box.min().array() - reach, box.max().array() + reach);
  }
  tree_.refit(boxes);
  pairs_.clear();
  tree_.query_pairs([&](int one, int other) {
    const Facet &a = facets_[one], &b = facets_[other];
    for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)})
      for (const int i : from->own)
        offer({false, {i, to->node[0], to->node[1], to->node[2]}}, nodes);
    for (const auto& e : a.edges)
      for (const auto& f : b.edges) offer({true, {e[0], e[1], f[0], f[1]}}, nodes);
  });
}

double PaperLayers::add_forces(const Particles& x, const Particles* velocity,
                               Particles& force) const {
  if (pairs_.empty()) return 0;
  const Nodes nodes = nodes_of(x);
  double sum_j = 0;
  for (const LayerPair& pair : pairs_) {
    if (are_apart(pair, nodes, thickness_)) continue;
    const NearestPoints nearest = nearest_points(pair, nodes);
    const double distance = nearest.apart.norm(), in = thickness_ - distance;
    if (!(in > 0) || !(distance > 0)) continue;
    const double part = part_of(pair, nodes);
    const Vector3d normal = nearest.apart / distance;
    double push = part * n_per_m_ * in;
    sum_j += 0.5 * push * in;
    if (velocity != nullptr) {
      double approach = 0;
      for (int k = 0; k < 4; ++k)
        approach -= nearest.weight[k] * normal.dot(velocity->col(pair.node[k]));
      push = std::max(0.0, push + part * damping_n_s_per_m_ * approach);
    }
    for (int k = 0; k < 4; ++k) force.col(pair.node[k]) += nearest.weight[k] * push * normal;
  }
  return sum_j;
}

double PaperLayers::energy_j(const Particles& x) const {
  Particles ignored = Particles::Zero(3, x.cols());
  return add_forces(x, nullptr, ignored);
}

double PaperLayers::stiffness_bound_per_s2() const {
  return thickness_ > 0 ? kMostPairs * n_per_m_ * per_kg_ : 0.0;
}

}  // namespace drape::simulate

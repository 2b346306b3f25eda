// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/layer_pushes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "simulate/contact/line_contacts.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = MeshCloth::State;

// Relative to the distance on the flat piece, as on the particle grid
constexpr double kOfFlat = 0.25;
constexpr double kAllowed = 0.5;    // thicknesses that nodes go before pairs are listed again
constexpr double kMore = 1 + 1e-9;  // relative to a displacement: rounding adds less

int count_of(const Field& nodes) {
  return static_cast<int>(nodes.size() / 3);
}

Vector3d mean_of(const Field& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < count_of(nodes); ++i) sum += at(nodes, i) / count_of(nodes);
  return sum;
}

}  // namespace

LayerPushes::LayerPushes(const MeshCloth& cloth, double gravity_m_per_s2, double thickness_m)
    : cloth_(cloth), surface_(cloth), thickness_(thickness_m) {
  const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  stiffness_ = mass * gravity_m_per_s2 / cloth.unknowns() / LineContacts::sink_m;
  const MaterialMesh& mesh = cloth.mesh();
  const int points = cloth.points();
  flat_.assign(3 * static_cast<std::size_t>(cloth.unknowns()), 0.0);
  for (int i = 0; i < cloth.unknowns(); ++i) {
    Eigen::Vector2d place;
    if (i < points)
      place = mesh.points_m[i];
    else
      place =
          (mesh.points_m[mesh.edges[i - points].from] + mesh.points_m[mesh.edges[i - points].to]) /
          2;
    put_at(flat_, i, {place.x(), place.y(), 0});
  }
  std::vector<bool> owned(static_cast<std::size_t>(cloth.unknowns()), false);
  std::set<std::array<int, 2>> edges;
  std::vector<Vector3d> centres;
  for (const std::array<int, 3>& node : surface_.facets()) {
    Facet facet;
    facet.node = node;
    for (int k = 0; k < 3; ++k) {
      const int a = node[k], b = node[(k + 1) % 3];
      if (!owned[a]) facet.own.push_back(a);
      owned[a] = true;
      const std::array<int, 2> edge = {std::min(a, b), std::max(a, b)};
      if (edges.insert(edge).second) facet.edges.push_back(edge);
    }
    centres.push_back((at(flat_, node[0]) + at(flat_, node[1]) + at(flat_, node[2])) / 3);
    facets_.push_back(std::move(facet));
  }
  tree_ = BoxTree(centres);
}

Field LayerPushes::nodes_of(const State& state) const {
  const State places = surface_.nodes(state);
  Field nodes(3 * places.size());
  for (std::size_t i = 0; i < places.size(); ++i) put_at(nodes, static_cast<int>(i), places[i]);
  return nodes;
}

/// A displacement of all nodes alike brings no pair nearer.
bool LayerPushes::is_listed(const Field& nodes) const {
  if (listed_.empty()) return false;
  const Vector3d mean = mean_of(nodes) - mean_of(listed_);
  for (int i = 0; i < count_of(nodes); ++i)
    if (!((at(nodes, i) - at(listed_, i) - mean).norm() <= allowed_[i])) return false;
  return true;
}

/// Pairs that may press anywhere on straight paths from `nodes` to `to`.
void LayerPushes::list(const Field& nodes, const Field& to) {
  listed_ = nodes;
  const Vector3d mean = mean_of(to) - mean_of(nodes);
  allowed_.assign(static_cast<std::size_t>(count_of(nodes)), kAllowed * thickness_);
  for (int i = 0; i < count_of(nodes); ++i)
    allowed_[i] = std::max(allowed_[i], kMore * (at(to, i) - at(nodes, i) - mean).norm());
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Facet& facet : facets_) {
    Eigen::AlignedBox3d box;
    double reach = 0;
    for (const int i : facet.node) {
      box.extend(at(nodes, i));
      reach = std::max(reach, allowed_[i]);
    }
    reach += thickness_ / 2;
    boxes.emplace_back(box.min().array() - reach, box.max().array() + reach);
  }
  tree_.refit(boxes);
  pairs_.clear();
  tree_.query_pairs([&](int one, int other) { list_facets(facets_[one], facets_[other]); });
}

void LayerPushes::list_facets(const Facet& a, const Facet& b) {
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)})
    for (const int i : from->own) offer({false, {i, to->node[0], to->node[1], to->node[2]}});
  for (const auto& one : a.edges)
    for (const auto& two : b.edges) offer({true, {one[0], one[1], two[0], two[1]}});
}

void LayerPushes::offer(const LayerPair& pair) {
  const int firsts = pair.edges ? 2 : 1;
  double first = 0, second = 0;
  for (int k = 0; k < 4; ++k) {
    for (int l = firsts; k < firsts && l < 4; ++l)
      if (pair.particle[k] == pair.particle[l]) return;
    double& most = k < firsts ? first : second;
    most = std::max(most, allowed_[pair.particle[k]]);
  }
  if (are_apart(pair, listed_, thickness_ + first + second)) return;
  Pair found{pair, thickness_, 1};
  if (!are_apart(pair, flat_, thickness_ / kOfFlat))
    found.thickness_m = std::min(thickness_, kOfFlat * nearest_points(pair, flat_).apart.norm());
  if (nearest_points(pair, listed_).apart.norm() > kMore * (found.thickness_m + first + second))
    return;
  found.part = part_of(pair, settled_);
  pairs_.push_back(found);
}

void LayerPushes::look(const State& state) {
  if (seen_ == state) return;
  seen_ = state;
  const Field nodes = nodes_of(state);
  if (settled_.empty()) settled_ = nodes;
  if (!is_listed(nodes)) list(nodes, nodes);
  presses_.clear();
  for (const Pair& pair : pairs_) {
    if (pair.part == 0 || are_apart(pair.of, nodes, pair.thickness_m)) continue;
    const NearestPoints nearest = nearest_points(pair.of, nodes);
    const double distance = nearest.apart.norm();
    if (!(distance < pair.thickness_m) || !(distance > 0)) continue;
    const LayerLaw law = layer_law(distance, pair.thickness_m, pair.part * stiffness_);
    presses_.push_back({pair.of.particle, nearest.weight, nearest.apart / distance, law.energy_j,
                        -law.slope_n, law.stiffness_n_per_m});
  }
}

double LayerPushes::energy_j(const State& state) {
  look(state);
  double sum = 0;
  for (const Press& press : presses_) sum += press.energy_j;
  return sum;
}

void LayerPushes::add_forces(const State& state, State& force) {
  look(state);
  State on_nodes(state.size(), Vector3d::Zero());
  for (const Press& press : presses_)
    for (int k = 0; k < 4; ++k)
      on_nodes[press.node[k]] += press.weight[k] * press.force_n * press.normal;
  surface_.add_forces(on_nodes, force);
}

/// The matrix has no pairs of points across layers: with w the weights of both, whose sizes sum to
/// two, (sum w x)^2 <= 2 sum |w| x^2.
std::vector<Support> LayerPushes::supports(const State& state) {
  look(state);
  std::vector<Support> found;
  for (const Press& press : presses_) {
    const Matrix3d all = 2 * press.n_per_m * press.normal * press.normal.transpose();
    for (int k = 0; k < 4; ++k) {
      const double weight = std::abs(press.weight[k]);
      const int side = press.node[k] - cloth_.points();
      if (weight == 0) continue;
      if (side < 0) {
        found.push_back({press.node[k], press.node[k], weight * all});
        continue;
      }
      const MaterialMesh::Edge& edge = cloth_.mesh().edges[side];
      for (const int end : {edge.from, edge.to}) found.push_back({end, end, weight / 2 * all});
      const auto of_sides = surface_.side_weights(side);
      double sum = 0;
      for (const auto& [unknown, of] : of_sides) sum += std::abs(of);
      for (const auto& [unknown, of] : of_sides)
        found.push_back({unknown, unknown, weight * sum * std::abs(of) * all});
    }
  }
  return found;
}

void LayerPushes::settle(const State& state) {
  settled_ = nodes_of(state);
  for (Pair& pair : pairs_) pair.part = part_of(pair.of, settled_);
  seen_.clear();
}

double LayerPushes::clear_part(const State& from, const State& to, bool led) {
  const Field start = nodes_of(from), end = nodes_of(to);
  if (settled_.empty()) settled_ = start;
  if (!is_listed(start) || !is_listed(end)) list(start, end);
  double part = 1;
  for (const Pair& pair : pairs_) {
    const double distance = nearest_points(pair.of, start).apart.norm();
    const double least =
        led ? std::min(kLayersStiffen * pair.thickness_m, distance) : kLayersKeep * distance;
    part = std::min(part, clear_fraction(pair.of, start, end, distance, least, part));
  }
  return part;
}

std::vector<ContactForce> LayerPushes::stated(const State& state, int shape) {
  look(state);
  std::vector<ContactForce> forces;
  for (const Press& press : presses_)
    forces.push_back({shape, press.node, press.weight, press.force_n * press.normal});
  return forces;
}

}  // namespace drape::simulate

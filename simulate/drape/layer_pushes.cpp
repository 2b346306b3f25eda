// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/layer_pushes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = MeshCloth::State;

constexpr double kSink_m = 2e-6;    // depth at which the spring carries a mean node's weight
constexpr double kOfFlat = 0.25;    // relative to the distance on the flat cloth
constexpr double kAllowed = 0.5;    // displacement, in thicknesses, before pairs are listed again
constexpr double kMore = 1 + 1e-9;  // relative to a displacement; covers rounding

/// Weighted sum of a pair's nodes.
Vector3d mix(const LayerPair& pair, const std::array<double, 4>& weight, const Nodes& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) sum += weight[k] * nodes[pair.node[k]];
  return sum;
}

Vector3d mean_of(const Nodes& nodes) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& node : nodes) sum += node / static_cast<double>(nodes.size());
  return sum;
}

}  // namespace

LayerPushes::LayerPushes(const MeshCloth& cloth, double friction, double gravity_m_per_s2,
                         double thickness_m)
    : cloth_(cloth), surface_(cloth), friction_(friction), thickness_(thickness_m) {
  const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  stiffness_ = mass * gravity_m_per_s2 / cloth.unknowns() / kSink_m;
  const MaterialMesh& mesh = cloth.mesh();
  const int points = cloth.points();
  for (int i = 0; i < cloth.unknowns(); ++i) {
    Eigen::Vector2d place;
    if (i < points)
      place = mesh.points_m[i];
    else
      place =
          (mesh.points_m[mesh.edges[i - points].from] + mesh.points_m[mesh.edges[i - points].to]) /
          2;
    flat_.emplace_back(place.x(), place.y(), 0);
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
    centres.push_back((flat_[node[0]] + flat_[node[1]] + flat_[node[2]]) / 3);
    facets_.push_back(std::move(facet));
  }
  tree_ = BoxTree(centres);
}

/// True if the list is still valid; a common displacement of all nodes brings no pair closer.
bool LayerPushes::is_listed(const Nodes& nodes) const {
  if (listed_.empty()) return false;
  const Vector3d mean = mean_of(nodes) - mean_of(listed_);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!((nodes[i] - listed_[i] - mean).norm() <= allowed_[i])) return false;
  return true;
}

/// Lists the pairs that can touch anywhere on straight paths from `nodes` to `to`.
void LayerPushes::list(const Nodes& nodes, const Nodes& to) {
  listed_ = nodes;
  const Vector3d mean = mean_of(to) - mean_of(nodes);
  allowed_.assign(nodes.size(), kAllowed * thickness_);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    allowed_[i] = std::max(allowed_[i], kMore * (to[i] - nodes[i] - mean).norm());
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Facet& facet : facets_) {
    Eigen::AlignedBox3d box;
    double reach = 0;
    for (const int i : facet.node) {
      box.extend(nodes[i]);
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
      if (pair.node[k] == pair.node[l]) return;
    double& most = k < firsts ? first : second;
    most = std::max(most, allowed_[pair.node[k]]);
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
  surface_.find_nodes(state, nodes_);
  if (settled_.empty()) settled_ = nodes_;
  if (!is_listed(nodes_)) list(nodes_, nodes_);
  presses_.clear();
  products_.clear();
  are_products_ = false;
  for (const Pair& pair : pairs_) {
    if (pair.part == 0 || are_apart(pair.of, nodes_, pair.thickness_m)) continue;
    const NearestPoints nearest = nearest_points(pair.of, nodes_);
    const double distance = nearest.apart.norm();
    if (!(distance < pair.thickness_m) || !(distance > 0)) continue;
    const LayerLaw law = layer_law(distance, pair.thickness_m, pair.part * stiffness_);
    presses_.push_back({pair.of, nearest.weight, nearest.apart / distance, law.energy_j,
                        -law.slope_n, law.stiffness_n_per_m});
  }
}

Vector3d LayerPushes::stretch_of(const Spring& spring) const {
  return spring.grip.stretch_at(mix(spring.of, spring.weight, nodes_));
}

Vector3d LayerPushes::force_of(const Spring& spring) const {
  const Vector3d stretch = stretch_of(spring);
  return -spring.grip.stiffness_at(stretch, stiffness_) * stretch;
}

const LayerPushes::Spring* LayerPushes::spring_of(const LayerPair& pair) const {
  const auto found =
      std::lower_bound(springs_.begin(), springs_.end(), pair,
                       [](const Spring& spring, const LayerPair& of) { return spring.of < of; });
  return found != springs_.end() && found->of == pair ? &*found : nullptr;
}

double LayerPushes::energy_j(const State& state) {
  look(state);
  double sum = 0;
  for (const Press& press : presses_) sum += press.energy_j;
  for (const Spring& spring : springs_)
    sum += spring.grip.energy_at(stretch_of(spring), stiffness_);
  return sum;
}

void LayerPushes::add_forces(const State& state, State& force) {
  look(state);
  State on_nodes(state.size(), Vector3d::Zero());
  const auto add = [&](const auto& of, const Vector3d& f) {
    for (int k = 0; k < 4; ++k) on_nodes[of.of.node[k]] += of.weight[k] * f;
  };
  for (const Press& press : presses_) add(press, press.force_n * press.normal);
  for (const Spring& spring : springs_) add(spring, force_of(spring));
  surface_.add_forces(on_nodes, force);
}

/// Second derivative of a pair's energy f of the distance D by displacements of the nodes: f'' n
/// n^T + f' (C - n n^T) / D, with C that of half the squared distance.
void LayerPushes::add_products(const State& state, const State& direction, State& product) {
  look(state);
  if (!are_products_) {
    for (const Press& press : presses_) {
      const NearestPoints nearest = nearest_points(press.of, nodes_);
      Eigen::Matrix<double, 12, 1> across;
      for (int k = 0; k < 4; ++k) across.segment<3>(3 * k) = press.weight[k] * press.normal;
      const double bend = press.force_n / nearest.apart.norm();
      products_.add(press.of.node, (press.n_per_m + bend) * across * across.transpose() -
                                       bend * distance_curvature(press.of, nearest, nodes_));
    }
    for (const Spring& spring : springs_) {
      const Vector3d stretch = stretch_of(spring);
      Matrix3d second;
      for (int axis = 0; axis < 3; ++axis)
        second.col(axis) = spring.grip.product_at(stretch, stiffness_, Vector3d::Unit(axis));
      products_.add(spring.of.node, spring.weight, second);
    }
    are_products_ = true;
  }
  products_.add_products(surface_, direction, product);
}

/// Diagonal bound for the preconditioner, which has no entries for pairs of points across layers:
/// with w the weights of both parts, whose magnitudes sum to two, (sum w x)^2 <= 2 sum |w| x^2.
std::vector<Support> LayerPushes::supports(const State& state) {
  look(state);
  std::vector<Support> found;
  const auto add = [&](const auto& of, const Matrix3d& stiffness) {
    for (int k = 0; k < 4; ++k) {
      const Matrix3d on_node = 2 * std::abs(of.weight[k]) * stiffness;
      const int side = of.of.node[k] - cloth_.points();
      if (of.weight[k] == 0) continue;
      if (side < 0) {
        found.push_back({of.of.node[k], of.of.node[k], on_node});
        continue;
      }
      const MaterialMesh::Edge& edge = cloth_.mesh().edges[side];
      for (const int end : {edge.from, edge.to}) found.push_back({end, end, on_node / 2});
      const auto of_sides = surface_.side_weights(side);
      double sum = 0;
      for (const auto& [unknown, weight] : of_sides) sum += std::abs(weight);
      for (const auto& [unknown, weight] : of_sides)
        found.push_back({unknown, unknown, sum * std::abs(weight) * on_node});
    }
  };
  for (const Press& press : presses_)
    add(press, press.n_per_m * press.normal * press.normal.transpose());
  for (const Spring& spring : springs_)
    add(spring, spring.grip.stiffness_at(stretch_of(spring), stiffness_) *
                    (Matrix3d::Identity() - spring.grip.normal * spring.grip.normal.transpose()));
  return found;
}

void LayerPushes::settle(const State& state) {
  look(state);
  add_springs(state);
  settled_ = nodes_;
  for (Pair& pair : pairs_) pair.part = part_of(pair.of, settled_);
  seen_.clear();
}

/// Adds springs for the pairs in contact, which keep the stretch of earlier ones.
void LayerPushes::add_springs(const State& state) {
  look(state);
  std::vector<Spring> now;
  for (const Press& press : presses_) {
    if (friction_ <= 0) break;
    Spring spring{press.of, press.weight, {}};
    spring.grip.place = mix(press.of, press.weight, nodes_);
    spring.grip.normal = press.normal;
    spring.grip.limit = friction_ * press.force_n;
    if (const Spring* before = spring_of(press.of)) spring.grip.stretch = stretch_of(*before);
    spring.grip.settle(stiffness_);
    now.push_back(spring);
  }
  std::sort(now.begin(), now.end(), [](const Spring& a, const Spring& b) { return a.of < b.of; });
  springs_ = std::move(now);
}

double LayerPushes::clear_part(const State& from, const State& to, bool led) {
  const Nodes start = surface_.nodes(from), end = surface_.nodes(to);
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
  for (const Press& press : presses_) {
    forces.push_back({shape, press.of.node, press.weight, press.force_n * press.normal});
    if (const Spring* spring = spring_of(press.of))
      forces.back().force_in_world += force_of(*spring);
  }
  return forces;
}

std::array<Eigen::Vector2d, 2> LayerPushes::material_of(const LayerPair& pair,
                                                        const std::array<double, 4>& weight) const {
  std::array<Eigen::Vector2d, 2> sum = {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  const int firsts = pair.edges ? 2 : 1;
  for (int k = 0; k < 4; ++k)
    sum[k < firsts ? 0 : 1] += std::abs(weight[k]) * flat_[pair.node[k]].head<2>();
  return sum;
}

void LayerPushes::remember(ContactMemory& memory) const {
  memory.mesh_m = cloth_.mesh().points_m;
  memory.layers.clear();
  for (const Spring& spring : springs_) {
    const auto [first, second] = material_of(spring.of, spring.weight);
    memory.layers.push_back(
        {spring.of.edges, spring.of.node, spring.weight, first, second, spring.grip});
  }
}

void LayerPushes::take_over(const ContactMemory& memory, const State& state) {
  springs_.clear();
  if (memory.mesh_m == cloth_.mesh().points_m) {
    for (const ContactMemory::OnLayer& on : memory.layers)
      springs_.push_back({{on.edges, on.node}, on.weight, on.grip});
    return;
  }
  add_springs(state);
  const double area = std::accumulate(cloth_.area_m2().begin(), cloth_.area_m2().end(), 0.0);
  const double reach =
      ContactMemory::kReach * std::sqrt(area / static_cast<double>(memory.mesh_m.size()));
  for (Spring& spring : springs_) {
    const auto [first, second] = material_of(spring.of, spring.weight);
    double least = reach;
    for (const ContactMemory::OnLayer& on : memory.layers)
      for (const bool turned : {false, true}) {
        const double away = std::max(((turned ? on.second_m : on.first_m) - first).norm(),
                                     ((turned ? on.first_m : on.second_m) - second).norm());
        if (away >= least) continue;
        least = away;
        spring.grip.stretch = turned ? Vector3d(-on.grip.stretch) : on.grip.stretch;
      }
    spring.grip.settle(stiffness_);
  }
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/layer_contacts.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "simulate/contact/line_contacts.hpp"
#include "simulate/contact/neighbours.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kNotAsked = -1e300;  // a distance that was not asked for
// Relative to the thickness: beyond, no rounding makes a pair press
constexpr double kSurely = 1 + 1e-9;

}  // namespace

LayerContacts::LayerContacts(const Cloth& cloth, double gravity_m_per_s2, double thickness_m)
    : grid_(cloth.grid()), thickness_(thickness_m) {
  if (!on()) return;
  stiffness_ = cloth.total_mass_kg() / cloth.count() * gravity_m_per_s2 / LineContacts::sink_m;
  std::vector<Vector3d> material;
  const int s = grid_.cols;
  for (int i = 0; i < grid_.count(); ++i) {
    const int r = i / s, c = i % s;
    if (!grid_.has_cell(r, c)) continue;
    Cell cell;
    cell.corner = i;
    cell.row = r;
    cell.col = c;
    const bool right = grid_.has_cell(r, c + 1), below = grid_.has_cell(r + 1, c);
    cell.vertex[cell.vertices++] = i;
    if (!right && !grid_.has_cell(r - 1, c + 1)) cell.vertex[cell.vertices++] = i + 1;
    if (!below && !grid_.has_cell(r + 1, c - 1)) cell.vertex[cell.vertices++] = i + s;
    if (!right && !below && !grid_.has_cell(r + 1, c + 1)) cell.vertex[cell.vertices++] = i + s + 1;
    cell.edge[cell.edges++] = {i, i + 1};
    cell.edge[cell.edges++] = {i, i + s};
    cell.edge[cell.edges++] = {i + 1, i + s};
    if (!right) cell.edge[cell.edges++] = {i + 1, i + s + 1};
    if (!below) cell.edge[cell.edges++] = {i + s, i + s + 1};
    cell.triangle = {{{i, i + 1, i + s}, {i + 1, i + s + 1, i + s}}};
    cells_.push_back(cell);
    material.emplace_back(r * grid_.warp_spacing_m(), c * grid_.weft_spacing_m(), 0);
  }
  tree_ = BoxTree(material);
  boxes_.resize(cells_.size());
}

void LayerContacts::begin(const Field& position) {
  if (!on()) return;
  start_ = position;
  listed_.clear();
  pairs_.clear();
  lands_ = false;
  for (Cell& cell : cells_) cell.apart.fill(kNotAsked);
  list(position);
}

void LayerContacts::watch(const Field& to) {
  if (on()) list(to);
}

bool LayerContacts::goes_elsewhere(const Cell& cell, const Field& to) const {
  for (const int i :
       {cell.corner, cell.corner + 1, cell.corner + grid_.cols, cell.corner + grid_.cols + 1}) {
    if (at(to, i) != at(listed_, i)) return true;
  }
  return false;
}

/// The bounding ball of a cell at the start, its displacement, and how far particles deviate from
/// that.
void LayerContacts::measure(Cell& cell, const Field& to) const {
  const std::array<int, 4> corners{cell.corner, cell.corner + 1, cell.corner + grid_.cols,
                                   cell.corner + grid_.cols + 1};
  cell.centre.setZero();
  cell.displacement.setZero();
  for (const int i : corners) {
    cell.centre += 0.25 * at(start_, i);
    cell.displacement += 0.25 * (at(to, i) - at(start_, i));
  }
  cell.radius = cell.spread = 0;
  for (const int i : corners) {
    cell.radius = std::max(cell.radius, (at(start_, i) - cell.centre).norm());
    cell.spread = std::max(cell.spread, (at(to, i) - at(start_, i) - cell.displacement).norm());
  }
}

bool LayerContacts::may_meet(Cell& a, const Cell& b) {
  const Vector3d apart = a.centre - b.centre, displacement = a.displacement - b.displacement;
  const double moved2 = displacement.squaredNorm();
  const double fraction =
      moved2 > 0 ? std::clamp(-apart.dot(displacement) / moved2, 0.0, 1.0) : 0.0;
  const int rows = b.row - a.row, cols = b.col - a.col;
  if (rows <= 1 && std::abs(cols) <= 1) {  // the later one lies to the right or below
    double& apart_m = a.apart[rows == 0 ? 0 : 2 + cols];
    if (apart_m == kNotAsked) apart_m = least_apart_m(grid_, start_, a.corner, b.corner);
    return apart_m <= kSurely * (thickness_ + displacement.norm() + a.spread + b.spread);
  }
  const double reach = a.radius + b.radius + a.spread + b.spread + thickness_;
  return (apart + fraction * displacement).squaredNorm() <= reach * reach;
}

/// Only of cells that go elsewhere than they did when it was asked last: the others' pairs are
/// listed.
void LayerContacts::list(const Field& to) {
  bool any = false;
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    Cell& cell = cells_[k];
    cell.changed = listed_.empty() || goes_elsewhere(cell, to);
    if (!cell.changed) continue;
    any = true;
    measure(cell, to);
    const Vector3d end = cell.centre + cell.displacement;
    const double reach = cell.radius + cell.spread + 0.5 * thickness_;
    boxes_[k] = Eigen::AlignedBox3d(cell.centre.cwiseMin(end), cell.centre.cwiseMax(end));
    boxes_[k].min().array() -= reach;
    boxes_[k].max().array() += reach;
  }
  if (!any) return;
  listed_ = to;
  tree_.refit(boxes_);
  found_.clear();
  tree_.query_pairs([&](int one, int other) {
    Cell& a = cells_[one];
    const Cell& b = cells_[other];
    if ((a.changed || b.changed) && may_meet(a, b)) list_cells(a, b, to);
  });
  std::sort(found_.begin(), found_.end(), [](const Pair& a, const Pair& b) { return a.of < b.of; });
  std::vector<Pair> all;
  all.reserve(pairs_.size() + found_.size());
  auto old = pairs_.begin();
  for (const Pair& pair : found_) {
    while (old != pairs_.end() && old->of < pair.of) all.push_back(*old++);
    if (old != pairs_.end() && old->of == pair.of) {
      all.push_back(*old++);
    } else {
      all.push_back(pair);
      all.back().part = part_of(pair.of, start_);
    }
  }
  all.insert(all.end(), old, pairs_.end());
  pairs_.swap(all);
}

/// Two particles of these cells come nearer by `closer` at most in a step, so that most pairs are
/// passed over before their own displacements are looked at.
void LayerContacts::list_cells(const Cell& a, const Cell& b, const Field& to) {
  const bool neighbours = std::abs(a.row - b.row) < 2 && std::abs(a.col - b.col) < 2;
  const double closer =
      2 * kSurely * ((a.displacement - b.displacement).norm() + a.spread + b.spread);
  const auto offer_near = [&](const LayerPair& pair) {
    if (!are_apart(pair, start_, thickness_ + closer)) offer(pair, neighbours, to);
  };
  for (const auto& [from, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (int v = 0; v < from->vertices; ++v) {
      for (const auto& t : other->triangle)
        offer_near({false, {from->vertex[v], t[0], t[1], t[2]}});
    }
  }
  for (int e = 0; e < a.edges; ++e) {
    for (int f = 0; f < b.edges; ++f)
      offer_near({true, {a.edge[e][0], a.edge[e][1], b.edge[f][0], b.edge[f][1]}});
  }
}

/// Takes a pair that may come nearer than a thickness in the step.
void LayerContacts::offer(const LayerPair& pair, bool neighbours, const Field& to) {
  const int firsts = pair.edges ? 2 : 1;
  if (neighbours && !are_two_layers(grid_, pair.particle, firsts)) return;
  std::array<Vector3d, 4> displacement;
  Vector3d mean = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    displacement[k] = at(to, pair.particle[k]) - at(start_, pair.particle[k]);
    mean += 0.25 * displacement[k];
  }
  double first = 0, second = 0;
  for (int k = 0; k < 4; ++k) {
    double& most = k < firsts ? first : second;
    most = std::max(most, (displacement[k] - mean).norm());
  }
  const double thickness = layers_apart_m(grid_, pair.particle, firsts, thickness_);
  if (are_apart(pair, start_, thickness + first + second)) return;
  const double distance = nearest_points(pair, start_).apart.norm();
  if (distance - first - second < thickness) found_.push_back({pair, thickness, distance});
}

double LayerContacts::safe_fraction(const Field& to) const {
  double farthest2 = 0;
  for (int i = 0; i < grid_.count(); ++i)
    farthest2 = std::max(farthest2, (at(to, i) - at(start_, i)).squaredNorm());
  // Two pieces whose particles move no farther than d come nearer by 4 d at most as
  // clear_fraction() counts, and its first step goes four fifths of the room or more.
  const double surely = 5 * std::sqrt(farthest2);
  double fraction = 1;
  for (const Pair& pair : pairs_) {
    const double distance = pair.distance_m;
    if ((1 - kLayersKeep) * distance > surely) continue;
    fraction = std::min(
        fraction, clear_fraction(pair.of, start_, to, distance, kLayersKeep * distance, fraction));
  }
  return fraction;
}

double LayerContacts::free_fraction(const Field& to) const {
  double fraction = 1;
  for (const Pair& pair : pairs_) {
    const double least = std::min(kLayersStiffen * pair.thickness_m, pair.distance_m);
    fraction =
        std::min(fraction, clear_fraction(pair.of, start_, to, pair.distance_m, least, fraction));
  }
  return fraction;
}

int LayerContacts::review(const Field& to) {
  int changed = 0;
  for (Pair& pair : pairs_) {
    if (pair.lands || pair.part == 0) continue;
    const double distance = pair.distance_m, thickness = pair.thickness_m;
    if (distance < thickness) continue;
    const NearestPoints nearest = nearest_points(pair.of, start_);
    double along = 0;
    for (int k = 0; k < 4; ++k)
      along += nearest.weight[k] * at(to, pair.of.particle[k]).dot(nearest.apart);
    if (along >= thickness * distance) continue;
    if (clear_fraction(pair.of, start_, to, distance, thickness) == 1) continue;
    pair.lands = lands_ = true;
    ++changed;
  }
  return changed;
}

double LayerContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const Pair& pair : pairs_) {
    if (are_apart(pair.of, position, pair.thickness_m)) continue;
    const double distance = nearest_points(pair.of, position).apart.norm();
    if (distance < pair.thickness_m)
      sum += pair.part * layer_law(distance, pair.thickness_m, stiffness_).energy_j;
  }
  return sum;
}

std::vector<LayerContacts::Push> LayerContacts::pushes(const Field& position) const {
  std::vector<Push> all;
  for (const Pair& pair : pairs_) {
    if (are_apart(pair.of, position, pair.thickness_m)) continue;
    const NearestPoints nearest = nearest_points(pair.of, position);
    const double distance = nearest.apart.norm();
    if (!(distance < pair.thickness_m) || !(distance > 0) || pair.part == 0) continue;
    all.push_back({pair.of.particle, nearest.weight,
                   -pair.part * layer_law(distance, pair.thickness_m, stiffness_).slope_n /
                       distance * nearest.apart});
  }
  return all;
}

void LayerContacts::add_forces(const Field& position, Field& force) const {
  for (const Push& push : pushes(position)) {
    for (int k = 0; k < 4; ++k) add_at(force, push.particle[k], push.weight[k] * push.force);
  }
}

int LayerContacts::pressing(const Field& position) const {
  return static_cast<int>(pushes(position).size());
}

std::vector<LayerContacts::Block> LayerContacts::blocks(const Field& position, bool convex) const {
  std::vector<Block> all;
  for (const Pair& pair : pairs_) {
    if (!pair.lands && are_apart(pair.of, position, pair.thickness_m)) continue;
    const NearestPoints nearest = nearest_points(pair.of, position);
    const double distance = nearest.apart.norm();
    const bool presses = distance < pair.thickness_m;
    if ((!presses && !pair.lands) || !(distance > 0) || pair.part == 0) continue;
    const LayerLaw at_distance =
        presses ? layer_law(distance, pair.thickness_m, stiffness_) : LayerLaw{0, 0, stiffness_};
    Eigen::Matrix<double, 12, 1> slope;
    for (int k = 0; k < 4; ++k)
      slope.segment<3>(3 * k) = nearest.weight[k] / distance * nearest.apart;
    Block block{pair.of.particle, {}};
    block.matrix = pair.part * at_distance.stiffness_n_per_m * slope * slope.transpose();
    if (presses && !convex) {
      block.matrix += pair.part * at_distance.slope_n / distance *
                      (distance_curvature(pair.of, nearest, position) - slope * slope.transpose());
    }
    all.push_back(block);
  }
  return all;
}

void LayerContacts::add_changes(Eigen::VectorXd& gradient) const {
  for (const Pair& pair : pairs_) {
    if (!pair.lands) continue;
    const NearestPoints nearest = nearest_points(pair.of, start_);
    const double distance = nearest.apart.norm();
    const Vector3d pull =
        pair.part * stiffness_ * (distance - pair.thickness_m) / distance * nearest.apart;
    for (int k = 0; k < 4; ++k)
      gradient.segment<3>(3 * pair.of.particle[k]) += nearest.weight[k] * pull;
  }
}

double LayerContacts::excess_curve(const Eigen::VectorXd& step) const {
  double sum = 0;
  for (const Pair& pair : pairs_) {
    if (!pair.lands) continue;
    const NearestPoints nearest = nearest_points(pair.of, start_);
    double along = 0;
    for (int k = 0; k < 4; ++k)
      along += nearest.weight[k] * step.segment<3>(3 * pair.of.particle[k]).dot(nearest.apart);
    sum += pair.part * stiffness_ * along * along / nearest.apart.squaredNorm();
  }
  return sum;
}

}  // namespace drape::simulate

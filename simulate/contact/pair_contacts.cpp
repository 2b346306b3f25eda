// SPDX-License-Identifier: Apache-2.0
#include "simulate/contact/pair_contacts.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "simulate/contact/line_contacts.hpp"
#include "simulate/contact/neighbours.hpp"

namespace drape::simulate {

namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

constexpr double kReachFraction = 0.3;   // relative to the spacing: pairs this near are watched
constexpr double kDeepest = 1e-3;        // m; a solid's feature deeper than this is another place
constexpr double kFaceTolerance = 0.02;  // rad; a solid's own faces may rise above the contact
// Times its length: a sheet so stretched diverges, and all its cells meet
constexpr double kTorn = 4;
// Relative to the thickness: longest displacement in one step
constexpr double kThroughFraction = 0.25;
// Relative to a solid's contact beyond a triangle or edge: no gaps between
constexpr double kSlack = 0.03;

AlignedBox3d grown(AlignedBox3d box, double by) {
  box.min().array() -= by;
  box.max().array() += by;
  return box;
}

/// The vertices, edges and triangles that a cell stands for; border cells also hold the border.
struct CellElements {
  std::array<int, 4> vertex{};
  std::array<std::array<int, 2>, 5> edge{};
  std::array<std::array<int, 3>, 2> triangle{};
  int vertices = 0, edges = 0;

  CellElements(const GridSpec& grid, int i) {
    const int s = grid.cols;
    const int r = i / s, c = i % s;
    const bool right = grid.has_cell(r, c + 1), below = grid.has_cell(r + 1, c);
    vertex[vertices++] = i;
    if (!right && !grid.has_cell(r - 1, c + 1)) vertex[vertices++] = i + 1;
    if (!below && !grid.has_cell(r + 1, c - 1)) vertex[vertices++] = i + s;
    if (!right && !below && !grid.has_cell(r + 1, c + 1)) vertex[vertices++] = i + s + 1;
    edge[edges++] = {i, i + 1};
    edge[edges++] = {i, i + s};
    edge[edges++] = {i + 1, i + s};
    if (!right) edge[edges++] = {i + 1, i + s + 1};
    if (!below) edge[edges++] = {i + s, i + s + 1};
    triangle[0] = {i, i + 1, i + s};
    triangle[1] = {i + 1, i + s + 1, i + s};
  }
};

constexpr double kFastImpact = 0.02;  // m/s; faster approach is stopped, also of pressed pairs
constexpr double kRestDepth = 10e-6;  // m; nor may deeper pairs approach at all
constexpr int kLandingSweeps = 3;
constexpr double kLeastMobility = 0.1;  // relative to a place whose particles nothing holds

}  // namespace

PairContacts::PairContacts(const Cloth& cloth, const Surroundings& surroundings, double friction,
                           double gravity_m_per_s2, double thickness_m)
    : grid_(cloth.grid()),
      count_(cloth.count()),
      friction_(friction),
      thickness_(thickness_m),
      mass_(&cloth.mass_kg()),
      features_(features_of(surroundings)) {
  const double mass = cloth.total_mass_kg() / cloth.count();
  stiffness_ = mass * gravity_m_per_s2 / LineContacts::sink_m;
  damping_ = 0.4 * std::sqrt(stiffness_ * mass);
  reach_ = kReachFraction * std::min(grid_.warp_spacing_m(), grid_.weft_spacing_m());
  if (thickness_ <= 0 && features_.corners.empty() && features_.edges.empty()) return;
  std::vector<Vector3d> centres;
  std::vector<AlignedBox3d> boxes;
  for (const SolidCorner& corner : features_.corners) {
    solids_.push_back(corner.point);
    boxes.emplace_back(corner.point, corner.point);
    centres.push_back(corner.point);
  }
  for (const SolidEdge& edge : features_.edges) {
    solids_.push_back(edge.a);
    solids_.push_back(edge.b);
    boxes.push_back(AlignedBox3d(edge.a, edge.a).extend(edge.b));
    centres.push_back(0.5 * (edge.a + edge.b));
  }
  solid_tree_ = BoxTree(centres);
  solid_tree_.refit(boxes);
  std::vector<Vector3d> material;
  for (int i = 0; i < count_; ++i) {
    const int r = i / grid_.cols, c = i % grid_.cols;
    if (!grid_.has_cell(r, c)) continue;
    cells_.push_back(i);
    material.emplace_back(r * grid_.warp_spacing_m(), c * grid_.weft_spacing_m(), 0);
  }
  sheet_tree_ = BoxTree(material);
  boxes_.resize(cells_.size());
  rows_.resize(count_);
}

Vector3d PairContacts::point(const Field& position, int node) const {
  return node < count_ ? at(position, node) : solids_[node - count_];
}

void PairContacts::watch(const Field& position, double path_m, double margin_m) {
  if (cells_.empty()) return;
  if (path_m + margin_m > fresh_until_) {
    refresh(position);
    fresh_until_ = path_m + 0.5 * reach_;  // two layers may come from both sides
  }
  choose(position, path_m, margin_m);
}

void PairContacts::refresh(const Field& position) {
  for (std::size_t k = 0; k < cells_.size(); ++k) {
    const int i = cells_[k];
    boxes_[k].setEmpty();
    for (const int corner : {i, i + 1, i + grid_.cols, i + grid_.cols + 1})
      boxes_[k].extend(at(position, corner));
  }
  std::vector<Pair> before;
  before.swap(pairs_);
  pairs_.clear();
  const double most = kTorn * std::max(grid_.warp_spacing_m(), grid_.weft_spacing_m());
  for (const AlignedBox3d& box : boxes_) {
    if (!(box.sizes().maxCoeff() <= most)) return;
  }
  if (thickness_ > 0) {
    sheet_tree_.refit(boxes_);
    for (std::size_t k = 0; k < cells_.size(); ++k) {
      sheet_tree_.query(grown(boxes_[k], reach_ + thickness_), [&](int other) {
        if (other > static_cast<int>(k)) emit_layers(position, cells_[k], cells_[other]);
      });
    }
  }
  if (!solids_.empty()) {
    for (std::size_t k = 0; k < cells_.size(); ++k) emit_solids(position, static_cast<int>(k));
  }
  keep_known(before);
}

void PairContacts::emit_layers(const Field& position, int one, int two) {
  const bool neighbours = are_neighbours(grid_, one, two);
  if (neighbours && least_apart_m(grid_, position, one, two) > reach_ + thickness_) return;
  const CellElements a(grid_, one), b(grid_, two);
  for (const auto& [from, to] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    for (int v = 0; v < from->vertices; ++v) {
      for (const auto& t : to->triangle)
        offer_layers(position, Kind::layers_point, {from->vertex[v], t[0], t[1], t[2]}, neighbours);
    }
  }
  for (int e = 0; e < a.edges; ++e) {
    for (int f = 0; f < b.edges; ++f)
      offer_layers(position, Kind::layers_edge,
                   {a.edge[e][0], a.edge[e][1], b.edge[f][0], b.edge[f][1]}, neighbours);
  }
}

void PairContacts::emit_solids(const Field& position, int cell) {
  const CellElements own(grid_, cells_[cell]);
  const int corners = static_cast<int>(features_.corners.size());
  solid_tree_.query(grown(boxes_[cell], reach_), [&](int feature) {
    if (feature < corners) {
      for (const auto& t : own.triangle)
        offer(position, Kind::solid_corner, {count_ + feature, t[0], t[1], t[2]}, feature);
      return;
    }
    const int edge = feature - corners;
    const int first = count_ + corners + 2 * edge;
    for (int e = 0; e < own.edges; ++e)
      offer(position, Kind::solid_edge, {own.edge[e][0], own.edge[e][1], first, first + 1}, edge);
  });
}

/// Takes a pair whose boxes come near each other.
void PairContacts::offer(const Field& position, Kind kind, const std::array<int, 4>& node,
                         int feature) {
  const int firsts = kind == Kind::layers_point || kind == Kind::solid_corner ? 1 : 2;
  AlignedBox3d one, two;
  for (int k = 0; k < 4; ++k) (k < firsts ? one : two).extend(point(position, node[k]));
  if (!grown(one, reach_ + thickness_).intersects(two)) return;
  Pair pair;
  pair.kind = kind;
  pair.node = node;
  pair.feature = feature;
  pair.thickness = thickness_;
  pairs_.push_back(pair);
}

/// The same where the pair is two layers. Boxes of neighbours meet, however flat the sheet is.
void PairContacts::offer_layers(const Field& position, Kind kind, const std::array<int, 4>& node,
                                bool neighbours) {
  const int firsts = kind == Kind::layers_point ? 1 : 2;
  if (!are_two_layers(grid_, node, firsts)) return;
  const std::size_t before = pairs_.size();
  offer(position, kind, node, 0);
  if (pairs_.size() == before) return;
  Pair& pair = pairs_.back();
  pair.thickness = layers_apart_m(grid_, node, firsts, thickness_);
  if (!neighbours) return;
  const std::optional<Meeting> meeting = meet(pair, position);
  const double distance = meeting ? meeting->gap + pair.thickness : apart(pair, position);
  if (distance > reach_ + thickness_) pairs_.pop_back();
}

/// Puts the pairs in order and takes over what is known of those that were watched before.
void PairContacts::keep_known(std::vector<Pair>& before) {
  const auto key = [](const Pair& pair) { return std::tie(pair.kind, pair.node); };
  std::sort(pairs_.begin(), pairs_.end(),
            [&](const Pair& a, const Pair& b) { return key(a) < key(b); });
  auto old = before.begin();
  for (Pair& pair : pairs_) {
    while (old != before.end() && key(*old) < key(pair)) ++old;
    if (old != before.end() && key(*old) == key(pair)) pair = *old;
  }
}

std::optional<PairContacts::Meeting> PairContacts::meet(const Pair& pair,
                                                        const Field& position) const {
  std::array<Vector3d, 4> p;
  for (int k = 0; k < 4; ++k) p[k] = point(position, pair.node[k]);
  std::optional<Nearest> nearest;
  switch (pair.kind) {
    case Kind::layers_point:
      nearest = point_to_triangle(p[0], p[1], p[2], p[3]);
      break;
    case Kind::layers_edge:
      nearest = edge_to_edge(p[0], p[1], p[2], p[3]);
      break;
    case Kind::solid_corner:
      nearest = point_over_triangle(p[0], p[1], p[2], p[3], kSlack);
      break;
    case Kind::solid_edge:
      nearest = edge_to_edge(p[0], p[1], p[2], p[3], kSlack);
  }
  if (!nearest) return std::nullopt;
  if (pair.kind == Kind::solid_corner || pair.kind == Kind::solid_edge)
    return meet_solid(pair, *nearest, p);
  const double distance = nearest->apart.norm();
  if (!(distance > 0)) {
    if (!pair.known) return std::nullopt;
    return Meeting{nearest->weight, pair.side, -pair.thickness};
  }
  Meeting meeting{nearest->weight, nearest->apart / distance, distance - pair.thickness};
  if (pair.known && meeting.direction.dot(pair.side) < 0) {
    meeting.direction = -meeting.direction;
    meeting.gap = -distance - pair.thickness;
  }
  return meeting;
}

/// The direction is that of the sheet's or the two edges' normal, and the solid must lie behind it:
/// what meets a solid elsewhere meets one of its faces.
std::optional<PairContacts::Meeting> PairContacts::meet_solid(
    const Pair& pair, const Nearest& nearest, const std::array<Vector3d, 4>& p) const {
  const bool corner = pair.kind == Kind::solid_corner;
  const Vector3d cross =
      corner ? (p[2] - p[1]).cross(p[3] - p[1]) : (p[1] - p[0]).cross(p[3] - p[2]);
  const double size = cross.norm();
  if (!(size > 0)) return std::nullopt;
  Vector3d normal = cross / size;
  const Vector3d& out =
      corner ? features_.corners[pair.feature].out : features_.edges[pair.feature].out;
  if (normal.dot(out) < 0) normal = -normal;
  if (corner) {
    for (const Vector3d& along : features_.corners[pair.feature].along) {
      if (normal.dot(along) > kFaceTolerance) return std::nullopt;
    }
    normal = -normal;
  } else {
    for (const Vector3d& face : features_.edges[pair.feature].face) {
      if (normal.dot(face) > kFaceTolerance) return std::nullopt;
    }
  }
  const double gap = nearest.apart.dot(normal);
  if (gap < -kDeepest) return std::nullopt;
  return Meeting{nearest.weight, normal, gap};
}

/// Lower bound of the distance of a pair that does not meet.
double PairContacts::apart(const Pair& pair, const Field& position) const {
  std::array<Vector3d, 4> p;
  for (int k = 0; k < 4; ++k) p[k] = point(position, pair.node[k]);
  if (pair.kind == Kind::layers_point || pair.kind == Kind::solid_corner)
    return point_to_triangle(p[0], p[1], p[2], p[3]).apart.norm();
  return std::min({point_to_edge_m(p[0], p[2], p[3]), point_to_edge_m(p[1], p[2], p[3]),
                   point_to_edge_m(p[2], p[0], p[1]), point_to_edge_m(p[3], p[0], p[1])});
}

void PairContacts::choose(const Field& position, double path_m, double margin_m) {
  chosen_.clear();
  std::fill(rows_.begin(), rows_.end(), 0.0);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    Pair& pair = pairs_[k];
    if (pair.clear_until > path_m + margin_m) continue;
    // A pair that stayed clear cannot have changed sides, however it has turned.
    if (!pair.chosen) pair.known = false;
    const std::optional<Meeting> meeting = meet(pair, position);
    const double gap = meeting ? meeting->gap : apart(pair, position) - pair.thickness;
    pair.clear_until = path_m + 0.5 * gap;
    pair.chosen = gap <= 2 * margin_m;
    if (!meeting || !pair.chosen) {
      pair.known = pair.pressed = false;
      pair.spring.setZero();
    }
    if (!pair.chosen) continue;
    chosen_.push_back(static_cast<int>(k));
    if (!meeting) continue;
    if (!pair.known) pair.side = meeting->direction;
    pair.known = true;
    double sum = 0;
    for (int c = 0; c < 4; ++c) sum += pair.node[c] < count_ ? std::abs(meeting->weight[c]) : 0;
    for (int c = 0; c < 4; ++c) {
      if (pair.node[c] < count_) rows_[pair.node[c]] += sum * std::abs(meeting->weight[c]);
    }
  }
  double most = 0;
  for (int i = 0; i < count_; ++i) {
    if (rows_[i] > 0) most = std::max(most, rows_[i] / (*mass_)[i]);
  }
  // In a heavily damped contact the rate of decay bounds the step, not its frequency.
  frequency2_ = std::max(stiffness_ * most, damping_ * most * damping_ * most);
}

Vector3d PairContacts::mix(const Pair& pair, const Meeting& meeting, const Field& field) const {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    if (pair.node[k] < count_) sum += meeting.weight[k] * at(field, pair.node[k]);
  }
  return sum;
}

double PairContacts::longest_path_m() const {
  return thickness_ > 0 && !pairs_.empty() ? kThroughFraction * thickness_
                                           : std::numeric_limits<double>::infinity();
}

std::optional<PairContacts::Push> PairContacts::push(const Pair& pair, const Field& position,
                                                     const Field* velocity) const {
  const std::optional<Meeting> meeting = meet(pair, position);
  if (!meeting || meeting->gap >= 0) return std::nullopt;
  const Vector3d& out = meeting->direction;
  double normal_n = -stiffness_ * meeting->gap;
  Vector3d tangential = -stiffness_ * pair.spring;
  if (velocity != nullptr) {
    const Vector3d rate = mix(pair, *meeting, *velocity);
    normal_n = std::max(0.0, normal_n - damping_ * rate.dot(out));
    tangential -= 0.5 * damping_ * rate;
  }
  tangential -= tangential.dot(out) * out;
  const double limit = friction_ * normal_n;
  const double size = tangential.norm();
  if (size > limit) tangential *= limit / size;
  return Push{*meeting, normal_n * out + tangential};
}

void PairContacts::add_forces(const Field& position, const Field* velocity, Field& force) const {
  const std::size_t n = position.size() / 3;
  for (const int k : chosen_) {
    const Pair& pair = pairs_[k];
    const std::optional<Push> found = push(pair, position, velocity);
    if (!found) continue;
    for (int c = 0; c < 4; ++c) {
      if (pair.node[c] >= count_) continue;
      for (int axis = 0; axis < 3; ++axis)
        force[axis * n + pair.node[c]] += found->meeting.weight[c] * found->force[axis];
    }
  }
}

double PairContacts::first_impact(const Field& start, const Field& end, double depth_m) const {
  double fraction = 1;
  for (const int k : chosen_) {
    if (pairs_[k].pressed) continue;
    const std::optional<Meeting> after = meet(pairs_[k], end);
    if (!after || after->gap >= -depth_m) continue;
    const std::optional<Meeting> before = meet(pairs_[k], start);
    if (!before || before->gap < 0) continue;
    fraction = std::min(fraction, before->gap / (before->gap - after->gap));
  }
  return fraction;
}

void PairContacts::land(const Field& position, const std::vector<double>& whole_inverse_mass,
                        const std::vector<double>& inverse_mass, Field& velocity) {
  const std::size_t n = position.size() / 3;
  for (int sweep = 0; sweep < kLandingSweeps; ++sweep) {
    for (const int k : chosen_) {
      Pair& pair = pairs_[k];
      const std::optional<Meeting> meeting = meet(pair, position);
      if (!meeting || meeting->gap > 0) continue;
      const double approach = -mix(pair, *meeting, velocity).dot(meeting->direction);
      const bool rests = pair.pressed && meeting->gap > -kRestDepth;
      if (approach <= (rests ? kFastImpact : 0.0)) continue;
      double mobility = 0, whole = 0;
      for (int c = 0; c < 4; ++c) {
        if (pair.node[c] >= count_) continue;
        const double square = meeting->weight[c] * meeting->weight[c];
        mobility += square * inverse_mass[pair.node[c]];
        whole += square * whole_inverse_mass[pair.node[c]];
      }
      if (!(mobility > 0)) continue;
      // A particle that barely carries the place cannot stop it for those that are held.
      mobility = std::max(mobility, kLeastMobility * whole);
      for (int c = 0; c < 4; ++c) {
        if (pair.node[c] >= count_) continue;
        const double change = approach / mobility * meeting->weight[c] * inverse_mass[pair.node[c]];
        for (int axis = 0; axis < 3; ++axis)
          velocity[axis * n + pair.node[c]] += change * meeting->direction[axis];
      }
    }
  }
}

void PairContacts::advance(const Field& position, const Field& velocity, double step_s) {
  for (const int k : chosen_) {
    Pair& pair = pairs_[k];
    const std::optional<Meeting> meeting = meet(pair, position);
    if (!meeting) continue;
    if (meeting->gap > -pair.thickness || pair.kind == Kind::solid_corner ||
        pair.kind == Kind::solid_edge) {
      pair.side = meeting->direction;
      pair.known = true;
    }
    pair.pressed = meeting->gap < 0;
    if (!pair.pressed) {
      pair.spring.setZero();
      continue;
    }
    pair.spring += step_s * mix(pair, *meeting, velocity);
    pair.spring -= pair.spring.dot(meeting->direction) * meeting->direction;
    const double limit = -friction_ * meeting->gap;
    const double size = pair.spring.norm();
    if (size > limit) pair.spring *= limit / size;
  }
}

int PairContacts::pressing(const Field& position) const {
  int count = 0;
  for (const Pair& pair : pairs_) {
    const std::optional<Meeting> meeting = meet(pair, position);
    count += meeting && meeting->gap < 0;
  }
  return count;
}

double PairContacts::deepest_solid_m(const Field& position) const {
  double deepest = 0;
  for (const int k : chosen_) {
    const Pair& pair = pairs_[k];
    if (pair.kind != Kind::solid_corner && pair.kind != Kind::solid_edge) continue;
    const std::optional<Meeting> meeting = meet(pair, position);
    if (meeting) deepest = std::max(deepest, -meeting->gap);
  }
  return deepest;
}

double PairContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const int k : chosen_) {
    const std::optional<Meeting> meeting = meet(pairs_[k], position);
    if (meeting && meeting->gap < 0) sum += 0.5 * stiffness_ * meeting->gap * meeting->gap;
  }
  return sum;
}

}  // namespace drape::simulate

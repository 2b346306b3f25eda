// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/object_pushes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using State = MeshCloth::State;

constexpr double kSunk_m = 0.1e-6;      // depth of cloth that bears its own weight alone
constexpr double kStiffen_m = 2e-6;     // depth from which places stiffen
constexpr double kGrip_m = 0.2e-6;      // stretch of springs that bear a weight along a surface
constexpr double kSoft = 0.1;           // relative stiffness before places are firm
constexpr double kSoftPlaces_m = 4e-3;  // distance of places before they are firm
// Distance of firm places, and displacement of nodes before sites are listed again; relative to the
// root of a triangle's mean area on wide meshes
constexpr double kPlaces_m = 0.5e-3, kOfWide = 0.15;
// Distance from a surface: a pin there says how deep the cloth is
constexpr double kNearPin_m = 0.2e-3;
constexpr double kNormalStep_m = 1e-7;  // for the curvature of a surface
// Path of a node that may lead through an object, and halvings of it where it does
constexpr double kThrough_m = 0.1e-3;
constexpr int kHalvings = 20;
constexpr double kOpposite = -0.1;  // cosine between normals; 0 across the edge of a box
// Relative stiffness of the matrix along a surface: cloth that nothing holds there has one too
constexpr double kLoose = 1e-4;
constexpr double kTurn = 0.1;  // of a normal over that step: an edge, which has none

/// Places of a triangle whose sides are cut in `cuts`: corners of its parts.
int places_of(int cuts) {
  return (cuts + 1) * (cuts + 2) / 2;
}

Vector3d weights_of(int k, int cuts) {
  int row = 0;
  for (; k > cuts - row; ++row) k -= cuts - row + 1;
  return Vector3d(cuts - row - k, row, k) / cuts;
}

/// Share of the triangle's area: a third of each part that the place is a corner of.
double share_of(const Vector3d& weights, int cuts) {
  const auto zeros = (weights.array() == 0).count();
  return (zeros == 0 ? 2.0 : zeros == 1 ? 1.0 : 1.0 / 3) / (cuts * cuts);
}

}  // namespace

ObjectPushes::ObjectPushes(const MeshCloth& cloth, const std::vector<bool>& held,
                           const Surroundings& surroundings, double friction,
                           double gravity_m_per_s2)
    : cloth_(cloth),
      held_(held),
      surroundings_(surroundings),
      surface_(cloth),
      friction_(friction) {
  const auto sum = [](const std::vector<double>& of) {
    return std::accumulate(of.begin(), of.end(), 0.0);
  };
  const double weight_pa = gravity_m_per_s2 * sum(cloth.mass_kg()) / sum(cloth.area_m2());
  stiffness_ = weight_pa / kSunk_m;
  grip_stiffness_ = weight_pa / kGrip_m;
  reach_m_ = std::max(
      kPlaces_m,
      kOfWide * std::sqrt(sum(cloth.area_m2()) / static_cast<double>(cloth.triangles().size())));
  divide();
}

int ObjectPushes::cuts_of(int facet, int shape) const {
  if (surroundings_.is_flat(shape)) return 1;  // nothing between nodes is deeper
  if (surroundings_.is_sharp(shape)) return cuts_[facet];
  return static_cast<int>(std::ceil(cuts_[facet] * sharp_places_m() / places_m()));
}

double ObjectPushes::places_m() const {
  return firmness_ > 0 ? reach_m_ : kSoftPlaces_m;
}

double ObjectPushes::sharp_places_m() const {
  return firmness_ > 0 ? std::min(kPlaces_m, places_m() / 2) : places_m() / 2;
}

void ObjectPushes::divide() {
  cuts_.clear();
  first_.clear();
  int places = 0;
  for (const MeshCloth::Triangle& triangle : cloth_.triangles())
    for (int facet = 0; facet < 4; ++facet) {
      cuts_.push_back(std::max(
          1, static_cast<int>(std::ceil(std::sqrt(triangle.area / 4) / sharp_places_m()))));
      first_.push_back(places);
      places += places_of(cuts_.back());
    }
  until_m_.assign(cloth_.triangles().size() * surroundings_.count(), 0.0);
  travelled_m_ = 0;
  listed_.clear();
  seen_.clear();
  sites_.clear();
}

Vector3d ObjectPushes::place_of(const Site& site) const {
  const std::array<int, 3>& node = surface_.facets()[site.facet];
  return site.weight[0] * nodes_[node[0]] + site.weight[1] * nodes_[node[1]] +
         site.weight[2] * nodes_[node[2]];
}

bool ObjectPushes::is_on_pin(int facet, int shape) const {
  const std::array<int, 3>& node = surface_.facets()[facet];
  return std::any_of(node.begin(), node.end(), [&](int k) {
    return k < cloth_.points() && held_[k] && surroundings_.gap_m(shape, nodes_[k]) < kNearPin_m;
  });
}

/// Sites that may press while no node goes farther than the margin, and those that remember.
void ObjectPushes::list() {
  double far2 = 0;
  for (std::size_t i = 0; i < listed_.size(); ++i)
    far2 = std::max(far2, (nodes_[i] - listed_[i]).squaredNorm());
  travelled_m_ += std::sqrt(far2);
  listed_ = nodes_;
  const int shapes = surroundings_.count();
  before_.swap(sites_);
  sites_.clear();
  auto old = before_.begin();
  const auto keep_until = [&](int id) {
    for (; old != before_.end() && old->id < id; ++old)
      if (old->grip.limit > 0) sites_.push_back(*old);
  };
  /// Distance of a ball about places from a shape, and its radius.
  const auto gap_beyond = [&](int shape, std::initializer_list<std::array<int, 3>> corners) {
    Vector3d middle = Vector3d::Zero();
    double radius2 = 0;
    for (const auto& corner : corners)
      for (const int i : corner) middle += nodes_[i] / (3 * static_cast<double>(corners.size()));
    for (const auto& corner : corners)
      for (const int i : corner) radius2 = std::max(radius2, (nodes_[i] - middle).squaredNorm());
    return surroundings_.gap_m(shape, middle) - std::sqrt(radius2);
  };
  const auto& facets = surface_.facets();
  std::vector<int> near, on_facet;
  for (std::size_t t = 0; t < cloth_.triangles().size(); ++t) {
    near.clear();
    for (int shape = 0; shape < shapes; ++shape) {
      double& until = until_m_[t * shapes + shape];
      if (until > travelled_m_ + reach_m_) continue;
      until =
          travelled_m_ + gap_beyond(shape, {facets[4 * t], facets[4 * t + 1], facets[4 * t + 2]});
      if (until <= travelled_m_ + reach_m_) near.push_back(shape);
    }
    for (int f = 4 * static_cast<int>(t); !near.empty() && f < 4 * static_cast<int>(t) + 4; ++f) {
      on_facet.clear();
      for (const int shape : near)
        if (gap_beyond(shape, {facets[f]}) <= reach_m_ && !is_on_pin(f, shape))
          on_facet.push_back(shape);
      if (on_facet.empty()) continue;
      for (int k = 0; k < places_of(cuts_[f]); ++k)
        for (const int shape : on_facet) {
          if (k >= places_of(cuts_of(f, shape))) continue;
          const int id = (first_[f] + k) * shapes + shape;
          keep_until(id);
          if (old != before_.end() && old->id == id)
            sites_.push_back(*old++);
          else
            sites_.push_back(site_of(id, f));
        }
    }
  }
  keep_until(std::numeric_limits<int>::max());
}

ObjectPushes::Site ObjectPushes::site_of(int id, int facet) const {
  Site site;
  site.id = id;
  site.facet = facet;
  site.shape = id % surroundings_.count();
  const int cuts = cuts_of(facet, site.shape);
  site.weight = weights_of(id / surroundings_.count() - first_[facet], cuts);
  site.area_m2 = cloth_.triangles()[facet / 4].area / 4 * share_of(site.weight, cuts);
  return site;
}

void ObjectPushes::look(const State& state) {
  if (seen_ == state) return;
  seen_ = state;
  nodes_ = surface_.nodes(state);
  bool listed = !listed_.empty();
  for (std::size_t i = 0; listed && i < nodes_.size(); ++i)
    listed = (nodes_[i] - listed_[i]).squaredNorm() <= reach_m_ * reach_m_;
  if (!listed) list();
  energy_j_ = 0;
  on_nodes_.assign(nodes_.size(), Vector3d::Zero());
  for (Site& site : sites_) {
    site.place = place_of(site);
    // No distance changes faster than a place.
    if (!(site.gap_m > 0) ||
        (site.place - site.looked_at).squaredNorm() >= site.gap_m * site.gap_m) {
      site.looked_at = site.place;
      site.gap_m = surroundings_.gap_m(site.shape, site.place);
      press(site);
    }
    if (!site.acts()) continue;
    Vector3d force = Vector3d::Zero();
    if (site.pressure_pa > 0) {
      site.normal = surroundings_.normal(site.shape, site.place);
      energy_j_ += site.area_m2 * site.energy_j_per_m2;
      force = site.area_m2 * site.pressure_pa * site.normal;
    }
    if (site.grip.limit > 0) {
      const Vector3d stretch = stretch_of(site);
      energy_j_ += site.area_m2 * site.grip.energy_at(stretch, grip_stiffness_);
      force -= site.area_m2 * site.grip.stiffness_at(stretch, grip_stiffness_) * stretch;
    }
    site.force_n = force;
    const std::array<int, 3>& node = surface_.facets()[site.facet];
    for (int k = 0; k < 3; ++k) on_nodes_[node[k]] += site.weight[k] * force;
  }
}

void ObjectPushes::press(Site& site) const {
  const double depth = std::max(0.0, -site.gap_m), times = depth / kStiffen_m;
  const double stiffness = is_firm() ? stiffness_ : kSoft * stiffness_;
  const double more = firmness_ > 0 ? times * times : 0;
  site.pressure_pa = stiffness * depth * (1 + more);
  site.energy_j_per_m2 = stiffness * depth * depth * (1 + more / 2) / 2;
  site.n_per_m3 = stiffness * (1 + 3 * more);
}

double ObjectPushes::energy_j(const State& state) {
  look(state);
  return energy_j_;
}

void ObjectPushes::add_forces(const State& state, State& force) {
  look(state);
  surface_.add_forces(on_nodes_, force);
}

/// a (p' n n^T - p G), with G the curvature of the distance, and the spring's.
Vector3d ObjectPushes::product_of(const Site& site, const Vector3d& displacement) const {
  Vector3d sum = Vector3d::Zero();
  const double size = displacement.norm();
  if (size <= 0) return sum;
  if (site.pressure_pa > 0) {
    sum += site.n_per_m3 * site.normal.dot(displacement) * site.normal;
    const Vector3d step = kNormalStep_m / size * displacement;
    const Vector3d turn = surroundings_.normal(site.shape, site.place + step) -
                          surroundings_.normal(site.shape, site.place - step);
    if (turn.norm() < kTurn) sum -= site.pressure_pa * size / (2 * kNormalStep_m) * turn;
  }
  if (site.grip.limit > 0)
    sum += site.grip.product_at(stretch_of(site), grip_stiffness_, displacement);
  return site.area_m2 * sum;
}

void ObjectPushes::add_products(const State& state, const State& direction, State& product) {
  look(state);
  if (products_at_ != state) list_products();
  products_at_ = state;
  const State moved = surface_.nodes(direction);
  State on_nodes(nodes_.size(), Vector3d::Zero());
  Eigen::Matrix<double, 9, 1> of_nodes;
  for (const FacetProducts& one : products_) {
    const std::array<int, 3>& node = surface_.facets()[one.facet];
    for (int k = 0; k < 3; ++k) of_nodes.segment<3>(3 * k) = moved[node[k]];
    const Eigen::Matrix<double, 9, 1> of = one.second * of_nodes;
    for (int k = 0; k < 3; ++k) on_nodes[node[k]] += of.segment<3>(3 * k);
  }
  surface_.add_forces(on_nodes, product);
}

void ObjectPushes::list_products() {
  products_.clear();
  for (const Site& site : sites_) {
    if (!site.acts()) continue;
    if (products_.empty() || products_.back().facet != site.facet)
      products_.push_back({site.facet, Eigen::Matrix<double, 9, 9>::Zero()});
    Matrix3d of;
    for (int axis = 0; axis < 3; ++axis) of.col(axis) = product_of(site, Vector3d::Unit(axis));
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        products_.back().second.block<3, 3>(3 * a, 3 * b) += site.weight[a] * site.weight[b] * of;
  }
}

/// The matrix has points and sides apart: places are mixed from the triangle's corners, and from
/// what the sides bend them out. Sides have a place each in the matrix: with w the weights of a
/// mixture, (sum w x)^2 <= sum |w| sum |w| x^2.
std::vector<Support> ObjectPushes::supports(const State& state) {
  look(state);
  std::vector<Support> found;
  std::vector<Matrix3d> on_middle(nodes_.size() - cloth_.points(), Matrix3d::Zero());
  std::array<Matrix3d, 6> pairs;  // of corners of the triangle
  int triangle = -1, facet = -1;
  Matrix3d corners;  // weights of the triangle's corners, by node of the facet
  const auto finish = [&] {
    if (triangle < 0) return;
    const auto& corner = cloth_.triangles()[triangle].corner;
    for (int a = 0, pair = 0; a < 3; ++a)
      for (int b = 0; b <= a; ++b, ++pair)
        if (!pairs[pair].isZero(0)) found.push_back({corner[a], corner[b], pairs[pair]});
  };
  for (const Site& site : sites_) {
    if (!site.acts()) continue;
    if (site.facet != facet) {
      facet = site.facet;
      for (int k = 0; k < 3; ++k) {
        const std::array<double, 3> of = surface_.corner_weights(facet, Vector3d::Unit(k));
        corners.col(k) = Vector3d(of[0], of[1], of[2]);
      }
    }
    if (facet / 4 != triangle) {
      finish();
      triangle = facet / 4;
      pairs.fill(Matrix3d::Zero());
    }
    Matrix3d stiffness = Matrix3d::Zero();
    if (site.pressure_pa > 0)
      stiffness += site.area_m2 * (kLoose * stiffness_ * Matrix3d::Identity() +
                                   site.n_per_m3 * site.normal * site.normal.transpose());
    if (site.grip.limit > 0)
      stiffness += site.area_m2 * site.grip.stiffness_at(stretch_of(site), grip_stiffness_) *
                   (Matrix3d::Identity() - site.grip.normal * site.grip.normal.transpose());
    const Vector3d of = corners * site.weight;
    for (int a = 0, pair = 0; a < 3; ++a)
      for (int b = 0; b <= a; ++b, ++pair) pairs[pair] += of[a] * of[b] * stiffness;
    for (int k = 0; k < 3; ++k) {
      const int middle = surface_.facets()[facet][k] - cloth_.points();
      if (middle >= 0) on_middle[middle] += site.weight[k] * stiffness;
    }
  }
  finish();
  for (std::size_t m = 0; m < on_middle.size(); ++m) {
    if (on_middle[m].isZero(0)) continue;
    const auto sides = surface_.side_weights(static_cast<int>(m));
    double all = 0;
    for (const auto& [side, of] : sides) all += std::abs(of);
    for (const auto& [side, of] : sides)
      found.push_back({side, side, std::abs(of) * all * on_middle[m]});
  }
  return found;
}

/// Places press by tenths of a micrometre and take turns with their neighbours. So that a settling
/// loses no traction, and the cloth does not creep, the others of a triangle that press on the same
/// object bear what a place bore that presses less, as far as their limits let them.
void ObjectPushes::settle(const State& state) {
  look(state);
  products_at_.clear();
  struct Held {
    Vector3d lost = Vector3d::Zero();  ///< force (N)
    double free_n = 0;                 ///< below the limits
  };
  std::vector<Held> held(until_m_.size());
  const auto held_of = [&](const Site& site) -> Held& {
    return held[site.facet / 4 * surroundings_.count() + site.shape];
  };
  const auto free_of = [&](const Site& site) {
    return std::max(0.0, site.grip.limit - grip_stiffness_ * site.grip.stretch.norm());
  };
  for (Site& site : sites_) {
    ContactMemory::Grip& grip = site.grip;
    const Vector3d stretch = grip.limit > 0 ? stretch_of(site) : Vector3d::Zero();
    Held& of = held_of(site);
    if (grip.limit > 0)
      of.lost += site.area_m2 * grip.stiffness_at(stretch, grip_stiffness_) * stretch;
    grip = {};
    if (site.pressure_pa <= 0 || friction_ <= 0) continue;
    grip = {site.place, site.normal, stretch, friction_ * site.pressure_pa};
    grip.settle(grip_stiffness_);
    of.lost -= site.area_m2 * grip_stiffness_ * grip.stretch;
    of.free_n += site.area_m2 * free_of(site);
  }
  for (Site& site : sites_) {
    const Held& of = held_of(site);
    if (site.grip.limit <= 0 || of.free_n <= 0) continue;
    site.grip.stretch += free_of(site) / (grip_stiffness_ * of.free_n) * of.lost;
    site.grip.settle(grip_stiffness_);
  }
  seen_.clear();
}

double ObjectPushes::clear_part(const State& from, const State& to, bool led) {
  bool far = false;
  for (int i = 0; !led && !far && i < cloth_.points(); ++i)
    far = (to[i] - from[i]).squaredNorm() > kThrough_m * kThrough_m / 4;
  if (!far) return 1;
  const State start = surface_.nodes(from), end = surface_.nodes(to);
  double part = 1;
  for (std::size_t i = 0; i < start.size(); ++i) {
    const double path = (end[i] - start[i]).norm();
    if (path < kThrough_m) continue;
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      const auto beyond = [&](double fraction) {
        const Vector3d there = start[i] + fraction * (end[i] - start[i]);
        return surroundings_.normal(shape, start[i]).dot(surroundings_.normal(shape, there)) <
               kOpposite;
      };
      if (surroundings_.is_flat(shape) || surroundings_.gap_m(shape, start[i]) > path ||
          !beyond(part) || !surroundings_.first_entry(shape, start[i], end[i], kThrough_m / 2))
        continue;
      double clear = 0;
      for (int halving = 0; halving < kHalvings; ++halving) {
        const double middle = (clear + part) / 2;
        (beyond(middle) ? part : clear) = middle;
      }
      part = clear;
    }
  }
  return part;
}

void ObjectPushes::make_firmer(const State& state) {
  if (is_firm()) return;
  ContactMemory memory;
  remember(memory);
  ++memory.firmness;
  take_over(memory, state);
}

std::vector<ContactForce> ObjectPushes::stated(const State& state) {
  look(state);
  std::vector<ContactForce> forces;
  for (const Site& site : sites_) {
    if (site.pressure_pa <= 0) continue;
    ContactForce force;
    force.shape = site.shape;
    force.force_in_world = site.force_n;
    const std::array<int, 3>& node = surface_.facets()[site.facet];
    force.particle = {node[0], node[1], node[2], node[0]};
    force.weight = {site.weight[0], site.weight[1], site.weight[2], 0};
    forces.push_back(force);
  }
  return forces;
}

void ObjectPushes::remember(ContactMemory& memory) const {
  memory.mesh_m = cloth_.mesh().points_m;
  memory.places_m = places_m();
  memory.firmness = firmness_;
  memory.objects.clear();
  for (const Site& site : sites_)
    if (site.grip.limit > 0)
      memory.objects.push_back({site.id, site.shape, material_of(site), site.grip});
}

Vector2d ObjectPushes::material_of(const Site& site) const {
  Vector2d sum = Vector2d::Zero();
  const std::array<double, 3> of = surface_.corner_weights(site.facet, site.weight);
  for (int k = 0; k < 3; ++k)
    sum += of[k] * cloth_.mesh().points_m[cloth_.triangles()[site.facet / 4].corner[k]];
  return sum;
}

void ObjectPushes::take_over(const ContactMemory& memory, const State& state) {
  products_at_.clear();
  firmness_ = memory.firmness;
  divide();
  if (memory.mesh_m == cloth_.mesh().points_m && memory.places_m == places_m()) {
    for (const ContactMemory::OnObject& place : memory.objects) {
      const auto after =
          std::upper_bound(first_.begin(), first_.end(), place.site / surroundings_.count());
      sites_.push_back(site_of(place.site, static_cast<int>(after - first_.begin()) - 1));
      sites_.back().grip = place.grip;
    }
    return;
  }
  const double reach = ContactMemory::kReach * std::max(places_m(), memory.places_m);
  const auto cell_of = [&](const Vector2d& p, int shape) {
    return std::array<int, 3>{shape, static_cast<int>(std::floor(p.x() / reach)),
                              static_cast<int>(std::floor(p.y() / reach))};
  };
  std::map<std::array<int, 3>, std::vector<const ContactMemory::OnObject*>> cells;
  for (const ContactMemory::OnObject& place : memory.objects)
    cells[cell_of(place.material_m, place.shape)].push_back(&place);
  look(state);
  for (Site& site : sites_) {
    const Vector2d at = material_of(site);
    const std::array<int, 3> cell = cell_of(at, site.shape);
    const ContactMemory::OnObject* nearest = nullptr;
    double least2 = reach * reach;
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) {
        const auto found = cells.find({cell[0], cell[1] + i, cell[2] + j});
        if (found == cells.end()) continue;
        for (const ContactMemory::OnObject* place : found->second) {
          const double distance2 = (place->material_m - at).squaredNorm();
          if (distance2 >= least2) continue;
          least2 = distance2;
          nearest = place;
        }
      }
    if (nearest == nullptr || friction_ <= 0) continue;
    site.grip = nearest->grip;
    site.grip.place = site.place;
    site.grip.normal = surroundings_.normal(site.shape, site.grip.place);
    site.grip.settle(grip_stiffness_);
  }
  seen_.clear();
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/pushes.hpp"

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

constexpr double kSunk_m = 0.1e-6;   // depth under the cloth's own weight
constexpr double kStiffen_m = 2e-6;  // depth at which the pressure law stiffens
constexpr double kGrip_m = 0.2e-6;   // stretch of a spring that carries a weight along a surface
// Before contact is firm: initial stiffness, and reduction of the remaining stiffening per
// stage.
constexpr double kSoft = 0.1, kLinear = 0.125;
// Spacing of contact points on coarse meshes, relative to the root of a triangle's mean area.
constexpr double kOfWide = 0.15;
// Between contact points a facet lies in an edge by its sagitta c^2 / (2 r), c the circumradius of
// the triangle on which they lie: this part of their spacing. The checker allows that of 0.45 mm,
// of which the points' own depth leaves kDeeper. Edges as round as kRound need no finer spacing on
// fine meshes.
constexpr double kOfPlaces = 0.6, kChecked_m = 0.45e-3, kDeeper_m = 0.02e-3, kRound_m = 2e-3;
// Range of evaluations per list that keeps the margin; least margin relative to the largest.
constexpr int kFewLooks = 4, kManyLooks = 16;
constexpr double kLeastMargin = 1.0 / 64;
// Distance from a surface within which a pin determines the depth of the cloth.
constexpr double kNearPin_m = 0.2e-3;
// Path length of a node above which it may cross an object, and bisections of such a path.
constexpr double kThrough_m = 0.1e-3;
constexpr int kHalvings = 20;
constexpr double kOpposite = -0.1;  // cosine between opposite normals; 0 across the edge of a box
// Relative tangential stiffness in the matrix, so that it is never singular along a surface.
constexpr double kLoose = 1e-4;

/// Contact points of a triangle with edges divided into `cuts`: the corners of its parts.
int places_of(int cuts) {
  return (cuts + 1) * (cuts + 2) / 2;
}

Vector3d weights_of(int k, int cuts) {
  int row = 0;
  for (; k > cuts - row; ++row) k -= cuts - row + 1;
  return Vector3d(cuts - row - k, row, k) / cuts;
}

/// Share of the triangle's area: a third of each part with a corner at the point.
double share_of(const Vector3d& weights, int cuts) {
  const auto zeros = (weights.array() == 0).count();
  return (zeros == 0 ? 2.0 : zeros == 1 ? 1.0 : 1.0 / 3) / (cuts * cuts);
}

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
  nodes_m_ = std::sqrt(sum(cloth.area_m2()) / cloth.unknowns());
  stiffness_ = weight_pa / kSunk_m;
  grip_stiffness_ = weight_pa / kGrip_m;
  reach_m_ = std::max(
      kPlaces_m,
      kOfWide * std::sqrt(sum(cloth.area_m2()) / static_cast<double>(cloth.triangles().size())));
  sharp_m_ = std::max(
      kRound_m, (std::pow(kOfPlaces * places_m(), 2) - kChecked_m * kChecked_m) / (2 * kDeeper_m));
  const auto& facets = surface_.facets();
  first_of_node_.assign(static_cast<std::size_t>(cloth.unknowns()) + 1, 0);
  for (const auto& facet : facets)
    for (const int node : facet) ++first_of_node_[node + 1];
  std::partial_sum(first_of_node_.begin(), first_of_node_.end(), first_of_node_.begin());
  facet_of_node_.resize(3 * facets.size());
  std::vector<int> next = first_of_node_;
  for (int f = 0; f < std::ssize(facets); ++f)
    for (const int node : facets[f]) facet_of_node_[next[node]++] = f;
  divide();
}

int ObjectPushes::cuts_of(int facet, int shape) const {
  if (surroundings_.edge_radius_m(shape) < sharp_m_) return cuts_[facet];
  return static_cast<int>(std::ceil(cuts_[facet] * sharp_places_m() / places_m()));
}

void ObjectPushes::divide() {
  cuts_.clear();
  first_.clear();
  owns_.clear();
  std::vector<bool> owned(static_cast<std::size_t>(cloth_.unknowns()), false);
  int places = 0;
  for (std::size_t f = 0; f < surface_.facets().size(); ++f) {
    const double side = std::sqrt(cloth_.triangles()[f / 4].area / 4);
    cuts_.push_back(std::max(1, static_cast<int>(std::ceil(side / sharp_places_m()))));
    first_.push_back(places);
    places += places_of(cuts_.back()) + 3;
    owns_.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const int node = surface_.facets()[f][k];
      owns_.back()[k] = !owned[node];
      owned[node] = true;
    }
  }
  places_.resize(1 + *std::max_element(cuts_.begin(), cuts_.end()));
  for (int cuts = 1; cuts < static_cast<int>(places_.size()); ++cuts) {
    places_[cuts].clear();
    for (int k = 0; k < places_of(cuts); ++k) {
      const Vector3d weights = weights_of(k, cuts);
      places_[cuts].push_back({weights, share_of(weights, cuts)});
    }
  }
  until_m_.assign(cloth_.triangles().size() * surroundings_.count(), 0.0);
  facet_until_m_.assign(4 * until_m_.size(), 0.0);
  travelled_m_ = 0;
  by_nodes_.clear();
  node_area_m2_.clear();
  margin_m_ = reach_m_;
  listed_.clear();
  free_m2_.clear();
  seen_.clear();
  sites_.clear();
}

Vector3d ObjectPushes::place_of(const Site& site) const {
  if (site.node >= 0) return nodes_[site.node];
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

/// Finds triangles that can come near a shape while no node moves farther than the reach.
void ObjectPushes::wake() {
  double far2 = 0;
  for (std::size_t i = 0; i < listed_.size(); ++i)
    far2 = std::max(far2, (nodes_[i] - listed_[i]).squaredNorm());
  travelled_m_ += std::sqrt(far2);
  listed_ = nodes_;
  for (int t = 0; t < std::ssize(cloth_.triangles()); ++t)
    for (int shape = 0; shape < surroundings_.count(); ++shape)
      if (is_awake(t, shape)) until_m_[at(t, shape)] = travelled_m_ + gap_beyond(shape, 4 * t, 3);
}

/// Distance of a ball around facets from a shape, minus its radius.
double ObjectPushes::gap_beyond(int shape, int facet, int facets) const {
  Vector3d middle = Vector3d::Zero();
  for (int f = facet; f < facet + facets; ++f)
    for (const int i : surface_.facets()[f]) middle += nodes_[i] / (3 * facets);
  double radius2 = 0;
  for (int f = facet; f < facet + facets; ++f)
    for (const int i : surface_.facets()[f])
      radius2 = std::max(radius2, (nodes_[i] - middle).squaredNorm());
  return surroundings_.gap_m(shape, middle) - std::sqrt(radius2);
}

/// Selects the facets that push back at their nodes.
void ObjectPushes::choose() {
  constexpr int kUnknown = -2;
  const bool first = by_nodes_.empty();
  by_nodes_.resize(surface_.facets().size() * surroundings_.count());
  std::vector<int> faces(nodes_.size());
  for (int shape = 0; shape < surroundings_.count(); ++shape) {
    std::fill(faces.begin(), faces.end(), kUnknown);
    const auto face_of = [&](int node) {
      if (faces[node] == kUnknown) faces[node] = surroundings_.nearest(shape, nodes_[node]).face;
      return faces[node];
    };
    for (int f = 0; f < std::ssize(surface_.facets()); ++f) {
      auto chosen = by_nodes_[at(f, shape)];
      if (surroundings_.is_flat(shape)) chosen = true;
      if (surroundings_.is_flat(shape) || !is_awake(f / 4, shape)) continue;
      if (is_firm() && !first && !chosen) continue;
      const std::array<int, 3>& node = surface_.facets()[f];
      const int face = face_of(node[0]);
      chosen = face >= 0 && face_of(node[1]) == face && face_of(node[2]) == face;
    }
  }
}

/// Computes the area of nodes in contact. True if it has changed.
bool ObjectPushes::weigh() {
  std::vector<double> area(nodes_.size() * surroundings_.count(), 0.0);
  for (int f = 0; f < std::ssize(surface_.facets()); ++f)
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      if (!by_nodes_[at(f, shape)] || is_on_pin(f, shape)) continue;
      for (const int node : surface_.facets()[f])
        area[at(node, shape)] += cloth_.triangles()[f / 4].area / 12;
    }
  area.swap(node_area_m2_);
  return area != node_area_m2_;
}

/// Lists the sites that may touch while no node near a shape moves farther than the margin, and
/// those that hold friction.
void ObjectPushes::list() {
  wake();
  if (by_nodes_.empty()) choose();
  if (node_area_m2_.empty()) (void)weigh();
  free_m2_.assign(nodes_.size(), reach_m_ * reach_m_);
  const int shapes = surroundings_.count();
  before_.swap(sites_);
  sites_.clear();
  auto old = before_.begin();
  const auto keep_until = [&](int id) {
    for (; old != before_.end() && old->id < id; ++old)
      if (old->grip.limit > 0) sites_.push_back(*old);
  };
  const auto& facets = surface_.facets();
  struct OnFacet {
    int shape = 0, places = 0;  ///< points in contact besides the nodes
  };
  std::vector<int> near;
  std::vector<OnFacet> on_facet;
  for (int t = 0; t < std::ssize(cloth_.triangles()); ++t) {
    near.clear();
    for (int shape = 0; shape < shapes; ++shape)
      if (is_awake(t, shape)) near.push_back(shape);
    for (int f = 4 * t; !near.empty() && f < 4 * t + 4; ++f) {
      for (const int i : facets[f]) free_m2_[i] = margin_m_ * margin_m_;
      on_facet.clear();
      for (const int shape : near) {
        double& until = facet_until_m_[at(f, shape)];
        if (until > travelled_m_ + margin_m_) continue;
        until = travelled_m_ + gap_beyond(shape, f, 1);
        if (until > travelled_m_ + margin_m_) continue;
        const bool places = !by_nodes_[at(f, shape)] && !is_on_pin(f, shape);
        on_facet.push_back({shape, places ? places_of(cuts_of(f, shape)) : 0});
      }
      const int places = places_of(cuts_[f]);
      for (int k = 0; !on_facet.empty() && k < places + 3; ++k)
        for (const auto& [shape, pressing] : on_facet) {
          const int corner = k - places;
          if (corner < 0 ? k >= pressing
                         : !owns_[f][corner] || node_area_m2_[at(facets[f][corner], shape)] <= 0)
            continue;
          Site site = site_of((first_[f] + k) * shapes + shape, f);
          keep_until(site.id);
          if (old != before_.end() && old->id == site.id) site.grip = (old++)->grip;
          site.looked_at = place_of(site);
          site.gap_m = surroundings_.gap_m(shape, site.looked_at);
          if (site.grip.limit > 0 || site.gap_m <= margin_m_) sites_.push_back(site);
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
  const int place = id / surroundings_.count() - first_[facet];
  const int corner = place - places_of(cuts_[facet]);
  if (corner >= 0) {
    site.node = surface_.facets()[facet][corner];
    site.weight = Vector3d::Unit(corner);
    site.area_m2 = node_area_m2_[at(site.node, site.shape)];
  } else {
    const Place& of = places_[cuts_of(facet, site.shape)][place];
    site.weight = of.weight;
    site.area_m2 = cloth_.triangles()[facet / 4].area / 4 * of.share;
  }
  return site;
}

void ObjectPushes::see(const State& state) {
  if (seen_ == state) return;
  seen_ = state;
  surface_.find_nodes(state, nodes_);
  looked_ = false;
}

void ObjectPushes::look(const State& state) {
  see(state);
  if (looked_) return;
  looked_ = true;
  products_.clear();
  are_products_ = false;
  const double least_m = kLeastMargin * reach_m_;
  bool listed = !free_m2_.empty() && (looks_ <= kManyLooks || margin_m_ <= least_m);
  for (std::size_t i = 0; listed && i < nodes_.size(); ++i)
    listed = (nodes_[i] - listed_[i]).squaredNorm() <= free_m2_[i];
  if (!listed) {
    if (looks_ < kFewLooks) margin_m_ *= 2;
    if (looks_ > kManyLooks) margin_m_ /= 4;
    margin_m_ = std::clamp(margin_m_, least_m, reach_m_);
    looks_ = 0;
    list();
  }
  ++looks_;
  const int left = kFirm - firmness_;
  const double stiffness = stiffness_ * std::pow(kSoft, static_cast<double>(left) / kFirm);
  const double stiffening = firmness_ > 0 ? std::pow(kLinear, left) / (kStiffen_m * kStiffen_m) : 0;
  energy_j_ = 0;
  on_nodes_.assign(nodes_.size(), Vector3d::Zero());
  for (Site& site : sites_) {
    site.place = place_of(site);
    Vector3d force = Vector3d::Zero();
    site.pressure_pa = 0;
    // A distance changes at most as fast as the point moves.
    if (!(site.gap_m > 0) ||
        (site.place - site.looked_at).squaredNorm() >= site.gap_m * site.gap_m) {
      const Surroundings::Nearest nearest = surroundings_.nearest(site.shape, site.place);
      site.looked_at = site.place;
      site.gap_m = nearest.gap_m;
      site.normal = nearest.normal;
      energy_j_ += site.area_m2 * press(site, stiffness, stiffening);
      site.pressure_pa *= nearest.slope;
      site.n_per_m3 *= nearest.slope * nearest.slope;
      force = site.area_m2 * site.pressure_pa * site.normal;
    }
    if (!site.acts()) continue;
    if (site.grip.limit > 0) {
      const Vector3d stretch = stretch_of(site);
      energy_j_ += site.area_m2 * site.grip.energy_at(stretch, grip_stiffness_);
      force -= site.area_m2 * site.grip.stiffness_at(stretch, grip_stiffness_) * stretch;
    }
    site.force_n = force;
    if (site.node >= 0) {
      on_nodes_[site.node] += force;
      continue;
    }
    const std::array<int, 3>& node = surface_.facets()[site.facet];
    for (int k = 0; k < 3; ++k) on_nodes_[node[k]] += site.weight[k] * force;
  }
}

/// Applies p = k d (1 + b d^2) at a site; returns the energy per area (J/m^2).
double ObjectPushes::press(Site& site, double k_n_per_m3, double b_per_m2) {
  const double depth = std::max(0.0, -site.gap_m), more = b_per_m2 * depth * depth;
  site.pressure_pa = k_n_per_m3 * depth * (1 + more);
  site.n_per_m3 = k_n_per_m3 * (1 + 3 * more);
  return k_n_per_m3 * depth * depth * (1 + more / 2) / 2;
}

double ObjectPushes::energy_j(const State& state) {
  look(state);
  return energy_j_;
}

void ObjectPushes::add_forces(const State& state, State& force) {
  look(state);
  surface_.add_forces(on_nodes_, force);
}

/// Adds second derivatives a (p' n n^T - p G), with G that of the distance, and the springs'.
void ObjectPushes::add_products(const State& state, const State& direction, State& product) {
  look(state);
  for (const Site& site : sites_) {
    if (are_products_ || !site.acts()) continue;
    Matrix3d second = Matrix3d::Zero();
    if (site.pressure_pa > 0)
      second = site.n_per_m3 * site.normal * site.normal.transpose() -
               site.pressure_pa * surroundings_.curvature(site.shape, site.place);
    if (site.grip.limit > 0) second += site.grip.second_at(stretch_of(site), grip_stiffness_);
    const ContactForce of = force_of(site);
    products_.add(of.particle, of.weight, site.area_m2 * second);
  }
  are_products_ = true;
  products_.add_products(surface_, direction, product);
}

/// Bounds for the preconditioner, which treats points and edges separately. Contact points are
/// weighted sums of the triangle's corners plus the displacement by its edges. Edges have diagonal
/// entries only: with w the weights of a sum, (sum w x)^2 <= sum |w| sum |w| x^2.
std::vector<Support> ObjectPushes::supports(const State& state) {
  look(state);
  std::vector<Support> found;
  std::vector<Matrix3d> on_middle(nodes_.size() - cloth_.points(), Matrix3d::Zero());
  std::array<Matrix3d, 6> pairs;  // for pairs of the triangle's corners
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

/// Updates the friction springs. Contact alternates between neighbouring points by tenths of a
/// micrometre. To preserve traction and prevent creep, other points of the same triangle and object
/// carry the friction lost at one, as far as their limits permit. A node contributes to each
/// adjacent triangle.
void ObjectPushes::settle(const State& state) {
  look(state);
  struct Held {
    Vector3d lost = Vector3d::Zero();  ///< lost force (N)
    double free_n = 0;                 ///< remaining capacity below the limits
  };
  std::vector<Held> held(until_m_.size());
  /// Calls visit(share of a triangle, area) for each part of a site.
  const auto visit_parts = [&](const Site& site, auto visit) {
    if (site.node < 0) return visit(held[at(site.facet / 4, site.shape)], site.area_m2);
    for (int k = first_of_node_[site.node]; k < first_of_node_[site.node + 1]; ++k) {
      const int f = facet_of_node_[k];
      if (by_nodes_[at(f, site.shape)] && !is_on_pin(f, site.shape))
        visit(held[at(f / 4, site.shape)], cloth_.triangles()[f / 4].area / 12);
    }
  };
  const auto free_of = [&](const Site& site) {
    return std::max(0.0, site.grip.limit - grip_stiffness_ * site.grip.stretch.norm());
  };
  for (Site& site : sites_) {
    ContactMemory::Grip& grip = site.grip;
    if (grip.limit <= 0) continue;
    grip.stretch = stretch_of(site);
    visit_parts(site, [&](Held& of, double area_m2) {
      of.lost += area_m2 * grip.stiffness_at(grip.stretch, grip_stiffness_) * grip.stretch;
    });
    grip.limit = 0;
  }
  choose();
  if (weigh()) {
    list();
    looked_ = false;
    look(state);
  }
  for (Site& site : sites_) {
    ContactMemory::Grip& grip = site.grip;
    const Vector3d stretch = grip.stretch;
    grip = {};
    if (site.pressure_pa <= 0 || friction_ <= 0) continue;
    grip = {site.place, site.normal, stretch, friction_ * site.pressure_pa};
    grip.settle(grip_stiffness_);
    visit_parts(site, [&](Held& of, double area_m2) {
      of.lost -= area_m2 * grip_stiffness_ * grip.stretch;
      of.free_n += area_m2 * free_of(site);
    });
  }
  for (Site& site : sites_) {
    if (site.grip.limit <= 0) continue;
    Vector3d more = Vector3d::Zero();
    visit_parts(site, [&](const Held& of, double area_m2) {
      if (of.free_n > 0) more += area_m2 / of.free_n * of.lost;
    });
    site.grip.stretch += free_of(site) / (grip_stiffness_ * site.area_m2) * more;
    site.grip.settle(grip_stiffness_);
  }
  looked_ = false;
}

double ObjectPushes::clear_part(const State& from, const State& to, bool led) {
  bool far = false;
  for (int i = 0; !led && !far && i < cloth_.points(); ++i)
    far = (to[i] - from[i]).squaredNorm() > kThrough_m * kThrough_m / 4;
  if (!far) return 1;
  const bool known = seen_ == from && !listed_.empty();
  const State start = known ? nodes_ : surface_.nodes(from), end = surface_.nodes(to);
  double part = 1;
  for (int corner = 0; corner < 3 * std::ssize(owns_); ++corner) {
    if (!owns_[corner / 3][corner % 3]) continue;
    const int i = surface_.facets()[corner / 3][corner % 3];
    const double path = (end[i] - start[i]).norm();
    if (path < kThrough_m) continue;
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      if (known && until_m_[at(corner / 12, shape)] > travelled_m_ + reach_m_ + path) continue;
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
  for (const Site& site : sites_)
    if (site.pressure_pa > 0) forces.push_back(force_of(site));
  return forces;
}

ContactForce ObjectPushes::force_of(const Site& site) const {
  ContactForce force;
  force.shape = site.shape;
  force.force_in_world = site.force_n;
  if (site.node >= 0) {
    force.particle.fill(site.node);
    force.weight = {1, 0, 0, 0};
    return force;
  }
  const std::array<int, 3>& node = surface_.facets()[site.facet];
  force.particle = {node[0], node[1], node[2], node[0]};
  force.weight = {site.weight[0], site.weight[1], site.weight[2], 0};
  return force;
}

void ObjectPushes::remember(ContactMemory& memory) const {
  memory.mesh_m = cloth_.mesh().points_m;
  memory.places_m = places_m();
  memory.firmness = firmness_;
  memory.by_nodes = by_nodes_;
  memory.objects.clear();
  for (const Site& site : sites_)
    if (site.grip.limit > 0)
      memory.objects.push_back({site.id, site.shape, material_of(site), reach_of(site), site.grip});
}

Vector2d ObjectPushes::material_of(const Site& site) const {
  Vector2d sum = Vector2d::Zero();
  const std::array<double, 3> of = surface_.corner_weights(site.facet, site.weight);
  for (int k = 0; k < 3; ++k)
    sum += of[k] * cloth_.mesh().points_m[cloth_.triangles()[site.facet / 4].corner[k]];
  return sum;
}

/// Radius around a site within which another mesh takes over its friction.
double ObjectPushes::reach_of(const Site& site) const {
  return site.node >= 0 ? nodes_m_ : ContactMemory::kReach * places_m();
}

void ObjectPushes::take_over(const ContactMemory& memory, const State& state) {
  firmness_ = memory.firmness;
  divide();
  if (memory.mesh_m == cloth_.mesh().points_m) {
    by_nodes_ = memory.by_nodes;
    if (memory.places_m == places_m()) {
      see(state);
      if (!by_nodes_.empty()) (void)weigh();
      for (const ContactMemory::OnObject& place : memory.objects) {
        const auto after =
            std::upper_bound(first_.begin(), first_.end(), place.site / surroundings_.count());
        sites_.push_back(site_of(place.site, static_cast<int>(after - first_.begin()) - 1));
        sites_.back().grip = place.grip;
      }
      return;
    }
  }
  double reach = std::max(nodes_m_, ContactMemory::kReach * places_m());
  for (const ContactMemory::OnObject& place : memory.objects)
    reach = std::max(reach, place.reach_m);
  const auto cell_of = [&](const Vector2d& p, int shape) {
    return std::array<int, 3>{shape, static_cast<int>(std::floor(p.x() / reach)),
                              static_cast<int>(std::floor(p.y() / reach))};
  };
  std::map<std::array<int, 3>, std::vector<const ContactMemory::OnObject*>> cells;
  for (const ContactMemory::OnObject& place : memory.objects)
    cells[cell_of(place.material_m, place.shape)].push_back(&place);
  look(state);
  for (Site& site : sites_) {
    const Vector2d here = material_of(site);
    const std::array<int, 3> cell = cell_of(here, site.shape);
    const ContactMemory::OnObject* nearest = nullptr;
    double least2 = std::numeric_limits<double>::infinity();
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j) {
        const auto found = cells.find({cell[0], cell[1] + i, cell[2] + j});
        if (found == cells.end()) continue;
        for (const ContactMemory::OnObject* place : found->second) {
          const double distance2 = (place->material_m - here).squaredNorm();
          const double most = std::max(reach_of(site), place->reach_m);
          if (distance2 >= std::min(least2, most * most)) continue;
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
  looked_ = false;
}

LayerPushes::LayerPushes(const MeshCloth& cloth, double friction, double gravity_m_per_s2,
                         double thickness_m)
    : cloth_(cloth),
      surface_(cloth),
      friction_(friction),
      thickness_(thickness_m),
      facets_(layer_facets(surface_.facets())) {
  const double mass = std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  stiffness_ = mass * gravity_m_per_s2 / cloth.unknowns() / kSink_m;
  for (int i = 0; i < cloth.unknowns(); ++i)
    flat_.emplace_back(cloth.material_m(i).x(), cloth.material_m(i).y(), 0);
  std::vector<Vector3d> centres;
  for (const std::array<int, 3>& node : surface_.facets())
    centres.push_back((flat_[node[0]] + flat_[node[1]] + flat_[node[2]]) / 3);
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
  for (const LayerFacet& facet : facets_) {
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
  tree_.query_pairs([&](int one, int other) {
    visit_pairs(facets_[one], facets_[other], [&](const LayerPair& pair) { offer(pair); });
  });
}

void LayerPushes::offer(const LayerPair& pair) {
  const int firsts = pair.edges ? 2 : 1;
  double first = 0, second = 0;
  if (share_a_node(pair)) return;
  for (int k = 0; k < 4; ++k) {
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
    for (const Spring& spring : springs_)
      products_.add(spring.of.node, spring.weight,
                    spring.grip.second_at(stretch_of(spring), stiffness_));
    are_products_ = true;
  }
  products_.add_products(surface_, direction, product);
}

/// Diagonal bound for the preconditioner, which has no entries for pairs of points across layers.
/// With w the weights of both parts, whose magnitudes sum to two, (sum w x)^2 <= 2 sum |w| x^2.
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

/// Adds springs for the pairs in contact; existing pairs keep their stretch.
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

std::array<Vector2d, 2> LayerPushes::material_of(const LayerPair& pair,
                                                 const std::array<double, 4>& weight) const {
  std::array<Vector2d, 2> sum = {Vector2d::Zero(), Vector2d::Zero()};
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

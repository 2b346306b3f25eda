// SPDX-License-Identifier: Apache-2.0
#include "simulate/drape/object_pushes.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "simulate/contact/deepest.hpp"
#include "simulate/contact/solid_features.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using State = MeshCloth::State;

constexpr double kGrip_m = 2e-6;    // that a point's weight stretches what holds it along a surface
constexpr double kSink_m = 2.5e-3;  // depth of the whole piece on one place at first ...
constexpr double kFirm = 10, kFirmer = 2;  // ... and stiffer by this in the end: 0.25 mm
constexpr double kFree_m = 1e-6;           // that a facet may enter: points on a face bear it all
// Distance from a surface: a pin there says how deep the cloth is
constexpr double kNearPin_m = 0.2e-3;
// Relative to the square root of a point's area: places nearer than this are taken over from
constexpr double kTakenFrom = 1.5;

}  // namespace

ObjectPushes::ObjectPushes(const MeshCloth& cloth, const std::vector<bool>& held,
                           const Surroundings& surroundings, double friction,
                           double gravity_m_per_s2)
    : cloth_(cloth),
      held_(held),
      surroundings_(surroundings),
      surface_(cloth),
      friction_(friction),
      carried_n_(static_cast<std::size_t>(cloth.points()) * surroundings.count(), 0.0) {
  const double weight =
      gravity_m_per_s2 * std::accumulate(cloth.mass_kg().begin(), cloth.mass_kg().end(), 0.0);
  grip_stiffness_ = weight / cloth.points() / kGrip_m;
  stiffness_ = weight / kSink_m;
  for (int shape = 0; shape < surroundings.count(); ++shape) {
    const Cylinder* const cylinder = surroundings.cylinder(shape);
    const bool sharp =
        is_sharp(surroundings, shape) || (cylinder != nullptr && cylinder->edge_radius_m == 0);
    between_.push_back(!sharp && !surroundings.is_flat(shape));
  }
}

Vector3d ObjectPushes::mix(const std::array<int, 3>& node, const Vector3d& weight) const {
  return weight[0] * nodes_[node[0]] + weight[1] * nodes_[node[1]] + weight[2] * nodes_[node[2]];
}

void ObjectPushes::look(const State& state) {
  if (seen_ == state) return;
  seen_ = state;
  // Without facets that press the middles of sides are not asked for.
  if (std::find(between_.begin(), between_.end(), true) != between_.end())
    nodes_ = surface_.nodes(state);
  else
    nodes_.assign(state.begin(), state.begin() + cloth_.points());
  pushes_.clear();
  gap_.resize(nodes_.size());
  const auto points = static_cast<std::size_t>(cloth_.points());
  const int shapes = surroundings_.count();
  const double stiffness = firmness_ * stiffness_;
  for (int shape = 0; shape < shapes; ++shape) {
    for (std::size_t i = 0; i < points; ++i) {
      gap_[i] = surroundings_.gap_m(shape, nodes_[i]);
      if (held_[i]) continue;
      const std::size_t site = i * shapes + shape;
      const double depth = carried_n_[site] / stiffness - gap_[i];
      if (depth <= 0) continue;
      Push push;
      push.site = static_cast<int>(site);
      push.node.fill(static_cast<int>(i));
      push.place = nodes_[i];
      push.normal = surroundings_.normal(shape, nodes_[i]);
      push.stiffness = stiffness;
      push.depth_m = depth;
      pushes_.push_back(push);
    }
    if (between_[shape]) look_at_facets(shape);
  }
}

void ObjectPushes::look_at_facets(int shape) {
  for (std::size_t k = static_cast<std::size_t>(cloth_.points()); k < nodes_.size(); ++k)
    gap_[k] = surroundings_.gap_m(shape, nodes_[k]);
  const auto& facets = surface_.facets();
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const std::array<int, 3>& node = facets[f];
    const SheetTriangle corners = {nodes_[node[0]], nodes_[node[1]], nodes_[node[2]]};
    const double longest2 =
        std::max({(corners[1] - corners[0]).squaredNorm(), (corners[2] - corners[1]).squaredNorm(),
                  (corners[0] - corners[2]).squaredNorm()});
    const double least = std::min({gap_[node[0]], gap_[node[1]], gap_[node[2]]});
    // No place is farther from all corners than a longest side, nor a distance steeper than one.
    if (least > 0 && least * least > longest2) continue;
    if (surroundings_.is_convex(shape)) {
      // A convex body lies behind the plane through its nearest point.
      const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
      const double gap = surroundings_.gap_m(shape, middle);
      const Vector3d normal = surroundings_.normal(shape, middle);
      bool clear = true;
      for (const Vector3d& corner : corners)
        clear = clear && gap + normal.dot(corner - middle) > -kFree_m;
      if (clear) continue;
    }
    // Points bear it all where nothing between them can be deeper.
    if (is_seen_flat(surroundings_, shape, corners)) continue;
    const bool by_pin = std::any_of(node.begin(), node.end(), [&](int k) {
      return k < cloth_.points() && held_[k] && gap_[k] < kNearPin_m;
    });
    if (by_pin) continue;
    const DeepestPlace deepest = deepest_place(surroundings_, shape, corners);
    const double depth = -deepest.depth_m - kFree_m;
    if (depth <= 0) continue;
    Push push;
    push.site = (cloth_.points() + static_cast<int>(f)) * surroundings_.count() + shape;
    push.node = node;
    push.weight = deepest.weights;
    push.place = mix(node, deepest.weights);
    push.normal = deepest.normal;
    push.stiffness = firmness_ * stiffness_;
    push.depth_m = depth;
    pushes_.push_back(push);
  }
}

Vector3d ObjectPushes::stretch_of(const Grip& grip) const {
  const Vector3d stretch = grip.stretch + mix(grip.node, grip.weight) - grip.place;
  return stretch - stretch.dot(grip.normal) * grip.normal;
}

Vector3d ObjectPushes::friction_of(const Grip& grip) const {
  const Vector3d stretch = stretch_of(grip);
  const double size = grip_stiffness_ * stretch.norm();
  return -grip_stiffness_ * (size > grip.limit_n ? grip.limit_n / size : 1) * stretch;
}

double ObjectPushes::energy_j(const State& state) {
  look(state);
  double sum = 0;
  for (const Push& push : pushes_) sum += push.force_n() * push.depth_m / 2;
  for (const Grip& grip : grips_) {
    const double size = stretch_of(grip).norm(), most = grip.limit_n / grip_stiffness_;
    sum += size <= most ? grip_stiffness_ / 2 * size * size : grip.limit_n * (size - most / 2);
  }
  return sum;
}

void ObjectPushes::add_forces(const State& state, State& force) {
  look(state);
  State on_nodes(nodes_.size(), Vector3d::Zero());
  const auto add = [&](const std::array<int, 3>& node, const Vector3d& weight, const Vector3d& f) {
    for (int k = 0; k < 3; ++k) on_nodes[node[k]] += weight[k] * f;
  };
  for (const Push& push : pushes_) add(push.node, push.weight, push.force_n() * push.normal);
  for (const Grip& grip : grips_) add(grip.node, grip.weight, friction_of(grip));
  surface_.add_forces(on_nodes, force);
}

/// The matrix has points and sides apart: places of facets are mixed from the triangle's corners,
/// and from what the sides bend them out.
void ObjectPushes::add_support(int site, const Vector3d& weight, const Matrix3d& stiffness,
                               std::vector<Support>& found) const {
  const int item = site / surroundings_.count(), facet = item - cloth_.points();
  if (facet < 0) {
    found.push_back({item, item, stiffness});
    return;
  }
  const std::array<double, 3> of = surface_.corner_weights(facet, weight);
  const auto& corner = cloth_.triangles()[facet / 4].corner;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b <= a; ++b) found.push_back({corner[a], corner[b], of[a] * of[b] * stiffness});
  // Sides have a place each in the matrix: the pairs go there, so that it is no softer.
  const auto sides = surface_.side_weights(facet, weight);
  double all = 0;
  for (const auto& [side, of_side] : sides) all += std::abs(of_side);
  for (const auto& [side, of_side] : sides)
    found.push_back({side, side, std::abs(of_side) * all * stiffness});
}

std::vector<Support> ObjectPushes::supports(const State& state) {
  look(state);
  std::vector<Support> found;
  for (const Push& push : pushes_)
    add_support(push.site, push.weight, push.stiffness * push.normal * push.normal.transpose(),
                found);
  for (const Grip& grip : grips_) {
    const double size = grip_stiffness_ * stretch_of(grip).norm();
    const double secant = grip_stiffness_ * (size > grip.limit_n ? grip.limit_n / size : 1);
    add_support(grip.site, grip.weight,
                secant * (Matrix3d::Identity() - grip.normal * grip.normal.transpose()), found);
  }
  return found;
}

void ObjectPushes::settle(const State& state) {
  if (friction_ <= 0) return;
  look(state);
  std::vector<Grip> before;
  before.swap(grips_);
  std::sort(pushes_.begin(), pushes_.end(),
            [](const Push& a, const Push& b) { return a.site < b.site; });
  auto old = before.begin();
  for (const Push& push : pushes_) {
    while (old != before.end() && old->site < push.site) ++old;
    Grip grip;
    grip.site = push.site;
    grip.node = push.node;
    grip.weight = push.weight;
    grip.place = push.place;
    grip.normal = push.normal;
    grip.limit_n = friction_ * push.force_n();
    grip.stretch.setZero();
    if (old != before.end() && old->site == push.site) grip.stretch = stretch_of(*old);
    grip.stretch -= grip.stretch.dot(grip.normal) * grip.normal;
    const double size = grip_stiffness_ * grip.stretch.norm();
    if (size > grip.limit_n) grip.stretch *= grip.limit_n / size;
    grips_.push_back(grip);
  }
}

double ObjectPushes::off_surface_m(const State& state) {
  look(state);
  const int points = cloth_.points() * surroundings_.count();
  double farthest = 0;
  for (const Push& push : pushes_)
    if (push.site < points)
      farthest =
          std::max(farthest, std::abs(push.depth_m - carried_n_[push.site] / push.stiffness));
  return farthest;
}

bool ObjectPushes::is_firm() const {
  return firmness_ >= kFirm;
}

void ObjectPushes::press_on(const State& state) {
  look(state);
  const int points = cloth_.points() * surroundings_.count();
  std::fill(carried_n_.begin(), carried_n_.end(), 0.0);
  for (const Push& push : pushes_)
    if (push.site < points) carried_n_[push.site] = push.force_n();
  firmness_ = std::min(kFirm, kFirmer * firmness_);
  seen_.clear();
}

std::vector<ContactForce> ObjectPushes::stated(const State& state) {
  look(state);
  const int shapes = surroundings_.count();
  std::vector<ContactForce> forces;
  for (const Push& push : pushes_) {
    ContactForce stated;
    stated.shape = push.site % shapes;
    stated.force_in_world = push.force_n() * push.normal;
    const auto grip = std::lower_bound(grips_.begin(), grips_.end(), push.site,
                                       [](const Grip& g, int site) { return g.site < site; });
    if (grip != grips_.end() && grip->site == push.site)
      stated.force_in_world += friction_of(*grip);
    const int facet = push.site / shapes - cloth_.points();
    if (facet < 0) {
      stated.particle.fill(push.node[0]);
      stated.weight = {1, 0, 0, 0};
    } else {
      const std::array<double, 3> weight = surface_.corner_weights(facet, push.weight);
      const auto& corner = cloth_.triangles()[facet / 4].corner;
      for (int k = 0; k < 3; ++k) {
        stated.particle[k] = corner[k];
        stated.weight[k] = weight[k];
      }
      stated.particle[3] = corner[0];
    }
    forces.push_back(stated);
  }
  return forces;
}

Eigen::Vector2d ObjectPushes::material_of(const std::array<int, 3>& node,
                                          const Vector3d& weight) const {
  const MaterialMesh& mesh = cloth_.mesh();
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int side = node[k] - cloth_.points();
    if (side < 0)
      sum += weight[k] * mesh.points_m[node[k]];
    else
      sum += weight[k] / 2 *
             (mesh.points_m[mesh.edges[side].from] + mesh.points_m[mesh.edges[side].to]);
  }
  return sum;
}

void ObjectPushes::remember(const State& state, ContactMemory& memory) {
  look(state);
  const int shapes = surroundings_.count();
  memory.firmness = firmness_;
  for (const Push& push : pushes_) {
    ContactMemory::Place place;
    place.shape = push.site % shapes;
    place.material_m = material_of(push.node, push.weight);
    if (const int point = push.site / shapes; point < cloth_.points())
      place.pressed_n_per_m2 = carried_n_[push.site] / cloth_.area_m2()[point];
    const auto grip = std::lower_bound(grips_.begin(), grips_.end(), push.site,
                                       [](const Grip& g, int site) { return g.site < site; });
    if (grip != grips_.end() && grip->site == push.site) place.stretch_m = stretch_of(*grip);
    memory.objects.push_back(place);
  }
}

void ObjectPushes::take_over(const ContactMemory& memory, const State& own) {
  firmness_ = memory.firmness;
  const int shapes = surroundings_.count(), points = cloth_.points();
  double area = 0;
  for (const double of_point : cloth_.area_m2()) area += of_point;
  const double reach = kTakenFrom * std::sqrt(area / points);
  const auto nearest = [&](int shape, const Eigen::Vector2d& at) {
    const ContactMemory::Place* found = nullptr;
    double least = reach * reach;
    for (const ContactMemory::Place& place : memory.objects) {
      const double away = (place.material_m - at).squaredNorm();
      if (place.shape != shape || away >= least) continue;
      least = away;
      found = &place;
    }
    return found;
  };
  for (int i = 0; i < points; ++i)
    for (int shape = 0; shape < shapes; ++shape)
      if (const auto* place = nearest(shape, cloth_.mesh().points_m[i]))
        carried_n_[i * shapes + shape] = place->pressed_n_per_m2 * cloth_.area_m2()[i];
  seen_.clear();
  grips_.clear();
  settle(own);
  for (Grip& grip : grips_) {
    const auto* place = nearest(grip.site % shapes, material_of(grip.node, grip.weight));
    if (place == nullptr) continue;
    grip.stretch = place->stretch_m - place->stretch_m.dot(grip.normal) * grip.normal;
    const double size = grip_stiffness_ * grip.stretch.norm();
    if (size > grip.limit_n) grip.stretch *= grip.limit_n / size;
  }
}

}  // namespace drape::simulate

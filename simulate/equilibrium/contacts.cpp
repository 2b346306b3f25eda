// SPDX-License-Identifier: Apache-2.0
#include "simulate/equilibrium/contacts.hpp"

#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;

using Eigen::Vector3d;

constexpr double kParticleSink = 0.2e-6;  // m; under a mean particle's weight, before multipliers
constexpr double kOverBending = 100;      // stiffness of a particle's contact over B / spacing^2
// Friction's limit of a step is kept while it is within these parts of what the pressing force
// allows.
constexpr double kLimitLow = 0.999;
constexpr double kLimitHigh = 1.02;  // a little too much is cut, which leaves a rest at rest
constexpr double kStiffer = 10;      // near rest, of a particle's contact
// m; friction that its spring's stretch could not exceed is left out: places that lie on a face to
// the last digits press now and then, and each time would hold the sheet for a step.
constexpr double kNoSpring = 1e-13;
constexpr double kPinOverStretch = 100;   // stiffness of a pin within a cell over the springs'
constexpr double kWhole = 1 - 1e-9;       // weight of a particle from which a pin holds just it
constexpr double kShallow = 1e-6;         // m; entries that a step may make
constexpr double kJustIn = 1e-7;          // m; deeper ones are lifted to here, and press
constexpr double kFarFromSurface = 1e-4;  // m; beyond, a step meant to leave it
constexpr double kSlides = 1 + 1e-9;      // a spring this much beyond its limit slides

}  // namespace

StaticContacts::StaticContacts(const Cloth& cloth, const Surroundings& surroundings,
                               double friction, double gravity_m_per_s2, bool between_particles)
    : cloth_(&cloth),
      surroundings_(&surroundings),
      friction_(friction),
      seeks_pieces_(between_particles && friction == 0),
      seeks_points_(between_particles && friction > 0),
      lines_(cloth, surroundings, friction, gravity_m_per_s2),
      index_(static_cast<std::size_t>(1 + kQuarters) * cloth.count() * surroundings.count() +
                 lines_.elements(),
             -1),
      is_pinned_(cloth.count(), 0) {
  const double weight = cloth.total_mass_kg() * gravity_m_per_s2 / cloth.count();
  const double spacing = std::min(cloth.grid().warp_spacing_m(), cloth.grid().weft_spacing_m());
  const double bending = std::max(cloth.laws().bending[0].slope, cloth.laws().bending[1].slope);
  particle_stiffness_ = weight / kParticleSink + kOverBending * bending / (spacing * spacing);
  shear_stiffness_ = lines_.shear_stiffness_n_per_m();
}

void StaticContacts::hold(const std::vector<Hold>& holds, const std::vector<Vector3d>& in_world) {
  holds_.clear();
  hold_in_world_.clear();
  pinned_.clear();
  is_pinned_.assign(cloth_->count(), 0);
  for (std::size_t h = 0; h < holds.size(); ++h) {
    const std::array<double, 4>& weight = holds[h].weight;
    const auto most = std::max_element(weight.begin(), weight.end());
    if (*most < kWhole) {
      holds_.push_back(holds[h]);
      hold_in_world_.push_back(in_world[h]);
      continue;
    }
    const int particle = holds[h].particle[most - weight.begin()];
    pinned_.push_back({particle, in_world[h]});
    is_pinned_[particle] = 1;
  }
  hold_place_ = hold_in_world_;
  sets_out_ = !pinned_.empty();
  hold_force_.assign(holds_.size(), Vector3d::Zero());
  hold_stiffness_ =
      kPinOverStretch * std::max(cloth_->laws().tensile[0].slope, cloth_->laws().tensile[1].slope);
}

bool StaticContacts::carry_pins(Field& position, double most_m) {
  bool moved = false;
  const auto towards = [&](const Vector3d& place, const Vector3d& from) -> Vector3d {
    const Vector3d displacement = place - from;
    const double length = displacement.norm();
    moved = moved || length > 0;
    if (length > most_m) return from + most_m / length * displacement;
    return place;
  };
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    if (sets_out_) hold_place_[h] = mix(position, holds_[h]);
    hold_place_[h] = towards(hold_in_world_[h], hold_place_[h]);
  }
  sets_out_ = false;
  for (const Pinned& pin : pinned_)
    put_at(position, pin.particle, towards(pin.place, at(position, pin.particle)));
  return moved;
}

StaticContacts::Contact StaticContacts::fresh_particle(int particle, int shape) const {
  Contact contact;
  contact.site = particle * surroundings_->count() + shape;
  contact.shape = shape;
  contact.particle.fill(particle);
  contact.weight = {1, 0, 0, 0};
  contact.stiffness = particle_stiffness_;
  contact.rigid = true;
  return contact;
}

double StaticContacts::pressing_n(const Contact& contact, double gap) const {
  return std::max(0.0, contact.multiplier - contact.stiffness * gap);
}

Vector3d StaticContacts::spring(const Contact& contact, const Vector3d& p) const {
  const Vector3d displacement = p - contact.anchor;
  return displacement - displacement.dot(contact.normal) * contact.normal;
}

void StaticContacts::refresh(const Field& position) {
  if (seeks_points_) lines_.refresh(position);
}

/// Lists the particles and points near a surface; those listed before keep what they remember. A
/// place found again elsewhere on the cloth keeps its spring's stretch, not the spring's far end:
/// friction would let the cloth go each time.
void StaticContacts::watch(const Field& position, double watch_m) {
  before_.swap(contacts_);
  contacts_.clear();
  contacts_.reserve(before_.size() + lines_.points().size() / 8);
  const auto keep = [&](Contact& contact) {
    const int old = index_[contact.site];
    if (old < 0 || before_[old].shape != contact.shape) return;
    const Contact& was = before_[old];
    contact.multiplier = was.multiplier;
    contact.anchored = was.anchored;
    contact.slips = was.slips;
    contact.limit = was.limit;
    contact.taken = was.taken;
    contact.slip_m = was.slip_m;
    contact.anchor = was.anchor + (mix(position, contact) - mix(position, was));
  };
  for (int i = 0; i < cloth_->count(); ++i) {
    if (is_pinned_[i] != 0) continue;
    const Vector3d p = at(position, i);
    for (int shape = 0; shape < surroundings_->count(); ++shape) {
      if (surroundings_->gap_m(shape, p) > watch_m) continue;
      contacts_.push_back(fresh_particle(i, shape));
      keep(contacts_.back());
    }
  }
  const std::size_t particles = contacts_.size();
  for (int i = 0; seeks_pieces_ && i < cloth_->count(); ++i) {
    if (cloth_->has_cell(i)) watch_cell(position, i);
  }
  const int first = cloth_->count() * surroundings_->count();
  for (const LineContacts::Point& point : lines_.points()) {
    Contact contact;
    contact.site = first + point.element;
    contact.shape = point.shape;
    contact.particle = point.particle;
    contact.weight = point.weight;
    contact.corners = 4;
    contact.stiffness = lines_.stiffness_n_per_m(point.shape);
    contacts_.push_back(contact);
  }
  for (std::size_t k = particles; k < contacts_.size(); ++k) keep(contacts_[k]);
  for (const Contact& contact : before_) index_[contact.site] = -1;
  for (std::size_t k = 0; k < contacts_.size(); ++k) {
    index_[contacts_[k].site] = static_cast<int>(k);
  }
}

/// Friction's limit and anchor for the coming step.
void StaticContacts::settle(Contact& contact, const Field& position, Limits limits) const {
  const Vector3d p = mix(position, contact);
  contact.gap = contact.slides ? contact.deepest.depth_m : surroundings_->gap_m(contact.shape, p);
  contact.normal =
      contact.slides ? contact.deepest.normal : surroundings_->normal(contact.shape, p);
  contact.change = Change::none;
  const double allowed = friction_ * pressing_n(contact, contact.gap);
  if (!(allowed > kNoSpring * shear_stiffness_)) {
    contact.anchored = contact.slips = false;
    contact.limit = contact.slip_m = 0;
    return;
  }
  if (!contact.anchored) contact.anchor = p;
  const Vector3d displacement = spring(contact, p);
  const bool within = contact.limit <= kLimitHigh * allowed && contact.limit >= kLimitLow * allowed;
  if (contact.limit == 0 || (limits == Limits::follow && !within)) {
    contact.limit = allowed;
  } else if (limits == Limits::follow) {
    contact.limit = std::min(contact.limit, allowed);
  }
  if (limits == Limits::follow || !contact.anchored) contact.taken = contact.limit / allowed;
  contact.anchored = true;
  const double most = contact.limit / shear_stiffness_;
  const double size = displacement.norm();
  contact.slide = size > 0 ? Vector3d(displacement / size) : Vector3d(Vector3d::Zero());
  contact.slip_m = size > most ? size : contact.slip_m;
  contact.slips = size > most * kSlides || (contact.slips && size > most / kSlides / kSlides);
  contact.anchor = p - (size > most ? most / size : 1.0) * displacement;
}

void StaticContacts::begin(const Field& position, double watch_m, Limits limits) {
  watch(position, watch_m);
  for (Contact& contact : contacts_) settle(contact, position, limits);
}

void StaticContacts::rest_on(const Field& position, const Field& force, double reach_m) {
  for (Contact& contact : contacts_) {
    if (!contact.rigid || contact.gap > reach_m) continue;
    const Vector3d pull =
        at(force, contact.particle[0]) - pressing_n(contact, contact.gap) * contact.normal;
    const double outward = pull.dot(contact.normal);
    if (outward >= 0) continue;
    contact.multiplier = -outward + contact.stiffness * contact.gap;
    contact.anchored = true;
    contact.limit = 0;  // settle() sets it
    contact.anchor =
        at(position, contact.particle[0]) - (pull - outward * contact.normal) / shear_stiffness_;
  }
}

/// Energy of a friction spring of length `size`; beyond its limit the force stays.
double StaticContacts::friction_j(const Contact& contact, double size) const {
  const double most = contact.limit / shear_stiffness_;
  return size > most ? contact.limit * (size - 0.5 * most) : 0.5 * shear_stiffness_ * size * size;
}

double StaticContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const Contact& contact : contacts_) {
    const double pressing = pressing_n(contact, gap_of(contact, position));
    sum +=
        (pressing * pressing - contact.multiplier * contact.multiplier) / (2 * contact.stiffness);
    if (contact.limit == 0) continue;
    sum += friction_j(contact, spring(contact, mix(position, contact)).norm());
  }
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    const Vector3d displacement = hold_place_[h] - mix(position, holds_[h]);
    sum += hold_force_[h].dot(displacement) + 0.5 * hold_stiffness_ * displacement.squaredNorm();
  }
  return sum;
}

/// What presses and rubs there (N).
Vector3d StaticContacts::force_of(const Contact& contact, const Pressing& here,
                                  const Field& position) const {
  const double pressing = pressing_n(contact, here.gap);
  Vector3d total = Vector3d::Zero();
  if (pressing > 0) total = pressing * here.normal;
  if (contact.limit > 0) {
    const Vector3d displacement = spring(contact, mix(position, contact));
    const double size = displacement.norm();
    const double most = contact.limit / shear_stiffness_;
    total -= (size > most ? contact.limit / size : shear_stiffness_) * displacement;
  }
  return total;
}

void StaticContacts::add_forces(const Field& position, Field& force) const {
  for (const Contact& contact : contacts_) {
    const Pressing here = pressing_at(contact, position);
    spread(here, force_of(contact, here, position), force);
  }
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    spread(holds_[h],
           hold_force_[h] + hold_stiffness_ * (hold_place_[h] - mix(position, holds_[h])), force);
  }
}

std::vector<ContactForce> StaticContacts::forces(const Field& position) const {
  std::vector<ContactForce> list;
  for (const Contact& contact : contacts_) {
    const Pressing here = pressing_at(contact, position);
    const Vector3d force = force_of(contact, here, position);
    if (!force.isZero(0)) list.push_back({contact.shape, here.particle, here.weight, force});
  }
  return list;
}

/// Where a free particle is caught on a straight path that ends in a body, or beyond it: in the
/// latter case, and where it would come out on the other side, as it enters. A path round an edge
/// is free.
std::optional<Vector3d> StaticContacts::caught(int shape, const Vector3d& start,
                                               const Vector3d& end, double deep_m) const {
  const std::optional<double> fraction = surroundings_->first_entry(shape, start, end, deep_m);
  if (!fraction) return std::nullopt;
  const Vector3d entry = start + *fraction * (end - start);
  if (surroundings_->on_opposite_sides(shape, entry, end)) return entry;
  if (surroundings_->gap_m(shape, end) < -deep_m) return end;
  return std::nullopt;
}

void StaticContacts::retract(const Field& from, Field& to) const {
  for (const Contact& contact : contacts_) {
    if (!contact.rigid) continue;
    const int i = contact.particle[0];
    const Vector3d start = at(from, i);
    const Vector3d end = at(to, i);
    std::optional<Vector3d> place = end;
    double meant = -kJustIn;
    if (pressing_n(contact, contact.gap) > 0 || contact.change == Change::lands) {
      // Where the straight model of the surface meant it to go.
      meant = contact.gap + (end - start).dot(contact.normal);
      if (std::abs(meant) > kFarFromSurface) continue;
    } else {
      place = caught(contact.shape, start, end, kShallow);
      if (!place) continue;
    }
    const double gap = surroundings_->gap_m(contact.shape, *place);
    const Vector3d normal = surroundings_->normal(contact.shape, *place);
    add_at(to, i, *place - end + (meant - gap) * normal);
  }
}

void StaticContacts::take_springs(const LineContacts& moved, const Field& position) {
  lines_ = moved;
  seeks_pieces_ = seeks_points_ = false;
  watch(position, 0);
  for (Contact& contact : contacts_) {
    if (contact.rigid) continue;
    const int element = contact.site - cloth_->count() * surroundings_->count();
    contact.anchored = true;
    contact.anchor = mix(position, contact) - moved.friction_spring_m(element);
  }
}

void StaticContacts::update_multipliers(const Field& position) {
  for (Contact& contact : contacts_) {
    if (contact.rigid || contact.slides)
      contact.multiplier = pressing_n(contact, gap_of(contact, position));
  }
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    hold_force_[h] += hold_stiffness_ * (hold_place_[h] - mix(position, holds_[h]));
  }
}

void StaticContacts::stiffen() {
  if (stiffened_) return;
  stiffened_ = true;
  particle_stiffness_ *= kStiffer;
}

double StaticContacts::pin_error_m(const Field& position) const {
  double largest = 0;
  for (const Pinned& pin : pinned_)
    largest = std::max(largest, (pin.place - at(position, pin.particle)).norm());
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    largest = std::max(largest, (hold_in_world_[h] - mix(position, holds_[h])).norm());
  }
  return largest;
}

double StaticContacts::gap_error_m(const Field& position) const {
  double largest = 0;
  for (const Contact& contact : contacts_) {
    if (!contact.rigid && !contact.slides) continue;
    const double gap = gap_of(contact, position);
    if (pressing_n(contact, gap) > 0) largest = std::max(largest, std::abs(gap));
  }
  return largest;
}

double StaticContacts::stored_j(const Field& position) const {
  double sum = 0;
  for (const Contact& contact : contacts_) {
    if (contact.rigid || contact.slides) continue;
    const double pressing = pressing_n(contact, gap_of(contact, position));
    sum += pressing * pressing / (2 * contact.stiffness);
  }
  return sum;
}

int StaticContacts::touching(const Field& position) const {
  return static_cast<int>(std::count_if(contacts_.begin(), contacts_.end(), [&](const Contact& c) {
    return c.rigid && pressing_n(c, surroundings_->gap_m(c.shape, mix(position, c))) > 0;
  }));
}

int StaticContacts::between() const {
  return static_cast<int>(
      std::count_if(contacts_.begin(), contacts_.end(), [](const Contact& c) { return !c.rigid; }));
}

int StaticContacts::sliding() const {
  return static_cast<int>(
      std::count_if(contacts_.begin(), contacts_.end(), [](const Contact& c) { return c.slips; }));
}

}  // namespace drape::simulate

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

constexpr double kMostChange = 3;  // relative to a limit in one step, up or down

constexpr double kWatchPiece = 0.2e-3;  // m; a piece farther from a surface stays off it in a step

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

/// Pressing and rubbing forces there (N).
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

Matrix3d StaticContacts::model_block(const Contact& contact, const Field& position,
                                     bool convex) const {
  const double pressing = pressing_n(contact, contact.gap);
  Matrix3d block = Matrix3d::Zero();
  const Matrix3d across = Matrix3d::Identity() - contact.normal * contact.normal.transpose();
  const bool presses = pressing > 0 && !contact.slides;  // else see add_piece_hessian()
  if (presses || contact.change == Change::lands) {
    block += contact.stiffness * contact.normal * contact.normal.transpose();
  }
  if (presses && !convex) {
    block -= pressing * gap_curvature(*surroundings_, contact.shape, mix(position, contact));
  }
  if (contact.limit == 0) return block;
  if (contact.change == Change::yields) {
    block += contact.yield.block;
  } else if (contact.slips && contact.change != Change::holds) {
    const Vector3d displacement = spring(contact, mix(position, contact)).normalized();
    const double length = std::max(contact.slip_m, contact.limit / shear_stiffness_);
    block += contact.limit / length * (across - displacement * displacement.transpose());
  } else {
    block += shear_stiffness_ * across;
  }
  return block;
}

void StaticContacts::add_piece_hessian(const Contact& contact, const Field& position, bool convex,
                                       GridMatrix& hessian) const {
  const double pressing = pressing_n(contact, contact.gap);
  if (!(pressing > 0)) return;
  const DeepestPlace& deepest = contact.deepest;
  const DepthCurvature curvature =
      depth_curvature(*surroundings_, contact.shape, piece_of(contact, position), deepest);
  const Matrix3d across = contact.stiffness * deepest.normal * deepest.normal.transpose();
  Eigen::Matrix<double, 9, 9> of_corners = pressing * curvature.slides;
  if (!convex) of_corners += pressing * curvature.bends;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b)
      of_corners.block<3, 3>(3 * a, 3 * b) += deepest.weights[a] * deepest.weights[b] * across;
  }
  const QuarterWeights weights = quarter_weights(contact.quarter);
  for (int k = 0; k < 4; ++k) {
    for (int l = 0; l <= k; ++l) {
      Matrix3d block = Matrix3d::Zero();
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b)
          block += weights(k, a) * weights(l, b) * of_corners.block<3, 3>(3 * a, 3 * b);
      }
      hessian.add(contact.particle[k], contact.particle[l], block);
    }
  }
}

void StaticContacts::add_hessian(const Field& position, bool convex, GridMatrix& hessian) {
  for (Contact& contact : contacts_) {
    contact.reviewed = false;
    contact.block.setZero();
    if (contact.slides) add_piece_hessian(contact, position, convex, hessian);
    if (contact.limit == 0 && contact.change != Change::lands &&
        pressing_n(contact, contact.gap) == 0) {
      continue;
    }
    contact.block = model_block(contact, position, convex);
    add_mixture(contact, contact.block, hessian);
  }
  for (const Hold& hold : holds_) {
    add_mixture(hold, hold_stiffness_ * Matrix3d::Identity(), hessian);
  }
}

void StaticContacts::change_hessian(const Field& position, bool convex, GridMatrix& hessian) {
  for (Contact& contact : contacts_) {
    if (!contact.reviewed) continue;
    contact.reviewed = false;
    const Matrix3d before = contact.block;
    contact.block = model_block(contact, position, convex);
    add_mixture(contact, contact.block - before, hessian);
  }
}

void StaticContacts::add_changes(Eigen::VectorXd& gradient) const {
  for (const Contact& contact : contacts_) {
    if (contact.change == Change::lands) {
      const double pull = contact.stiffness * contact.gap - contact.multiplier;
      gradient.segment<3>(3 * contact.particle[0]) += pull * contact.normal;
    } else if (contact.change == Change::yields) {
      spread_step(contact, contact.yield.pull, gradient);
    }
  }
}

double StaticContacts::excess_curve(const Eigen::VectorXd& step) const {
  double sum = 0;
  for (const Contact& contact : contacts_) {
    if (contact.change == Change::lands) {
      const double along = mix_step(step, contact).dot(contact.normal);
      sum += contact.stiffness * along * along;
    } else if (contact.change == Change::yields) {
      const Yield& yield = contact.yield;
      const Vector3d displacement = mix_step(step, contact);
      const Vector3d end =
          yield.spring + displacement - displacement.dot(contact.normal) * contact.normal;
      const double gained = friction_j(contact, end.norm()) -
                            friction_j(contact, yield.spring.norm()) -
                            shear_stiffness_ * yield.spring.dot(displacement);
      sum += displacement.dot(yield.block * displacement) - 2 * gained;
    }
  }
  return sum;
}

/// True if friction that holds changed between holding and yielding along the path of its place.
bool StaticContacts::review_yield(Contact& contact, const Vector3d& start,
                                  const Vector3d& end) const {
  const Vector3d stretched = spring(contact, end);
  const double size = stretched.norm();
  const bool beyond = size > contact.limit / shear_stiffness_;
  const bool changed = beyond != (contact.change == Change::yields);
  contact.change = beyond ? Change::yields : Change::none;
  contact.reviewed = contact.reviewed || changed || beyond;
  if (!beyond) return changed;
  const Vector3d unit = stretched / size;
  const Matrix3d across = Matrix3d::Identity() - contact.normal * contact.normal.transpose();
  Yield& yield = contact.yield;
  yield.spring = spring(contact, start);
  yield.block = contact.limit / size * (across - unit * unit.transpose());
  // Tangent at the end: limit * unit there, so this much more than the spring pulls at the start.
  yield.pull = contact.limit * unit + yield.block * yield.spring - shear_stiffness_ * yield.spring;
  return changed;
}

int StaticContacts::review(const Field& from, const Field& to, double deep_m) {
  int changed = 0;
  for (Contact& contact : contacts_) {
    const Vector3d start = mix(from, contact);
    const Vector3d end = mix(to, contact);
    const double pressing = pressing_n(contact, contact.gap);
    if (pressing == 0 && contact.change == Change::none && contact.rigid) {
      if (!caught(contact.shape, start, end, deep_m)) continue;
      contact.change = Change::lands;
      contact.reviewed = true;
      ++changed;
      continue;
    }
    const bool holds = contact.limit > 0 && !contact.slips && contact.change != Change::lands;
    if (yields_ && holds) {
      changed += review_yield(contact, start, end) ? 1 : 0;
      continue;
    }
    if (contact.slips && contact.change == Change::none &&
        (end - start).dot(spring(contact, start)) < 0) {
      contact.change = Change::holds;
      contact.reviewed = true;
      ++changed;
    }
  }
  return changed;
}

void StaticContacts::relinearise(const Field& position) {
  before_ = contacts_;
  for (Contact& contact : contacts_) {
    const Vector3d p = mix(position, contact);
    contact.change = Change::none;
    if (contact.slides) {
      contact.deepest = deepest_of(contact, position);
      contact.gap = contact.deepest.depth_m;
      contact.normal = contact.deepest.normal;
    } else {
      contact.gap = surroundings_->gap_m(contact.shape, p);
      contact.normal = surroundings_->normal(contact.shape, p);
    }
    if (contact.limit == 0) continue;
    const double size = spring(contact, p).norm();
    const double most = contact.limit / shear_stiffness_;
    contact.slips = size > most;
    contact.slip_m = std::max(size, most);
  }
}

bool StaticContacts::follows(const Contact& contact) const {
  return contact.limit > 0 && contact.slips && contact.change == Change::none &&
         pressing_n(contact, contact.gap) > 0;
}

/// The limit that the pressing force at the end of `displacement` allows.
double StaticContacts::limit_after(const Contact& contact, const Vector3d& displacement) const {
  return contact.taken * friction_ *
         pressing_n(contact, contact.gap + displacement.dot(contact.normal));
}

void StaticContacts::add_following(const Eigen::VectorXd& displacement,
                                   Eigen::VectorXd& product) const {
  for (const Contact& contact : contacts_) {
    if (!follows(contact)) continue;
    const double along = mix_step(displacement, contact).dot(contact.normal);
    spread_step(contact, -contact.taken * friction_ * contact.stiffness * along * contact.slide,
                product);
  }
}

void StaticContacts::add_lag(Eigen::VectorXd& gradient) const {
  for (const Contact& contact : contacts_) {
    if (!follows(contact)) continue;
    const double lag = limit_after(contact, Vector3d::Zero()) - contact.limit;
    spread_step(contact, lag * contact.slide, gradient);
  }
}

void StaticContacts::follow_pressing(const Field& position, const Eigen::VectorXd& displacement,
                                     Eigen::VectorXd& gradient) {
  for (Contact& contact : contacts_) {
    if (!follows(contact)) continue;
    const double limit = std::clamp(limit_after(contact, mix_step(displacement, contact)),
                                    contact.limit / kMostChange, contact.limit * kMostChange);
    spread_step(contact, (limit - contact.limit) * contact.slide, gradient);
    // While the limit allows it, so it slides from the start of the step on.
    contact.anchor = mix(position, contact) - limit / shear_stiffness_ * contact.slide;
    contact.limit = limit;
  }
}

/// The triangle of a cell, its corners the two particles of an edge and the cell's middle.
SheetTriangle StaticContacts::piece_of(const Contact& contact, const Field& position) const {
  SheetTriangle triangle;
  const QuarterWeights weights = quarter_weights(contact.quarter);
  for (int c = 0; c < 3; ++c) {
    triangle[c].setZero();
    for (int k = 0; k < 4; ++k) {
      if (weights(k, c) != 0) triangle[c] += weights(k, c) * at(position, contact.particle[k]);
    }
  }
  return triangle;
}

DeepestPlace StaticContacts::deepest_of(const Contact& contact, const Field& position) const {
  return deepest_place(*surroundings_, contact.shape, piece_of(contact, position));
}

double StaticContacts::gap_of(const Contact& contact, const Field& position) const {
  if (contact.slides) return deepest_of(contact, position).depth_m;
  return surroundings_->gap_m(contact.shape, mix(position, contact));
}

StaticContacts::Pressing StaticContacts::pressing_at(const Contact& contact,
                                                     const Field& position) const {
  if (contact.slides) {
    const DeepestPlace deepest = deepest_of(contact, position);
    return {contact.particle, weights_of(contact, deepest), deepest.normal, deepest.depth_m};
  }
  const Vector3d p = mix(position, contact);
  return {contact.particle, contact.weight, surroundings_->normal(contact.shape, p),
          surroundings_->gap_m(contact.shape, p)};
}

/// True if a pin puts the piece on the surface. Then only the pin says how deep it is: a piece that
/// turns about a place on a surface enters it by the square of the angle, and such a contact has no
/// finite force; two pins on a round body even hold the piece between them inside it.
bool StaticContacts::is_held_at(int shape, const Contact& piece, const Field& position) const {
  const auto is_near = [&](const Vector3d& p) {
    return surroundings_->gap_m(shape, p) < kWatchPiece;
  };
  for (int k = 0; k < piece.corners; ++k) {
    const int i = piece.particle[k];
    if (is_pinned_[i] != 0 && is_near(at(position, i))) return true;
  }
  return std::any_of(holds_.begin(), holds_.end(), [&](const Hold& hold) {
    for (int k = 0; k < 4; ++k) {
      const auto end = piece.particle.end();
      if (hold.weight[k] != 0 && std::find(piece.particle.begin(), end, hold.particle[k]) == end)
        return false;
    }
    return is_near(mix(position, hold));
  });
}

std::array<double, 4> StaticContacts::weights_of(const Contact& contact,
                                                 const DeepestPlace& deepest) {
  const Eigen::Vector4d weight = quarter_weights(contact.quarter) * deepest.weights;
  return {weight[0], weight[1], weight[2], weight[3]};
}

/// Lists the triangles of a cell that are near a surface and may be deeper than their corners.
void StaticContacts::watch_cell(const Field& position, int corner) {
  const int cols = cloth_->grid().cols;
  Contact contact;
  contact.corners = 4;
  contact.particle = {corner, corner + 1, corner + cols, corner + cols + 1};
  contact.slides = true;
  contact.stiffness = particle_stiffness_;
  Vector3d middle = Vector3d::Zero();
  for (const int i : contact.particle) middle += 0.25 * at(position, i);
  double reach = 0;
  for (const int i : contact.particle) reach = std::max(reach, (at(position, i) - middle).norm());
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    if (surroundings_->is_flat(shape)) continue;
    if (surroundings_->gap_m(shape, middle) - reach > kWatchPiece) continue;
    if (is_held_at(shape, contact, position)) continue;
    for (contact.quarter = 0; contact.quarter < kQuarters; ++contact.quarter) {
      const SheetTriangle triangle = piece_of(contact, position);
      if (is_seen_flat(*surroundings_, shape, triangle)) continue;
      contact.site =
          (cloth_->count() + kQuarters * corner + contact.quarter) * surroundings_->count() + shape;
      contact.deepest = deepest_place(*surroundings_, shape, triangle);
      if (contact.deepest.depth_m > kWatchPiece) continue;
      contact.shape = shape;
      contact.weight = weights_of(contact, contact.deepest);
      contacts_.push_back(contact);
    }
  }
}

}  // namespace drape::simulate

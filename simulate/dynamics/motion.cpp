// SPDX-License-Identifier: Apache-2.0
#include "simulate/dynamics/motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace drape::simulate {

namespace {

using Eigen::Vector3d;

constexpr double kRk4ImaginaryLimit = 2.828;
constexpr double kImpactDepth = 10e-6;  // m; shallower hits land without going back in time
// In m: covers the displacement within a step and released particles
constexpr double kClearMargin = 1e-3;
constexpr double kSurfacing = 2e-3;         // s; a shallow hit is lifted to the surface this gently
constexpr double kLiftGap = 1e-6;           // m; a touching particle further out has left
constexpr double kShortestFraction = 0.02;  // relative to a step when going back to an impact
constexpr int kRefreshSteps = 50;  // at most, between searches for contacts between particles
constexpr int kFollowSteps = 4;    // between two looks where on its line a place presses
constexpr double kRefreshTravel = 50e-6;  // m; at most any particle's path between searches
// A corner particle is a quarter of a mean one and takes part in up to a dozen line contacts.
constexpr double kLineContactFactor = 12;
constexpr double kPairFactor = 2;  // pairs that come to press before the limit is looked at again

}  // namespace

Motion::Motion(Cloth& cloth, const Surroundings& surroundings, const MotionOptions& options)
    : cloth_(cloth),
      surroundings_(surroundings),
      options_(options),
      line_contacts_(cloth, surroundings, options.friction, options.gravity_m_per_s2.norm(),
                     LineContacts::Shapes::smooth),
      pair_contacts_(cloth, options.contact_between_particles ? surroundings : Surroundings(),
                     options.friction, options.gravity_m_per_s2.norm(), options.cloth_thickness_m) {
  const std::size_t size = 3 * static_cast<std::size_t>(cloth.count());
  for (Field* field : {&position, &velocity, &start_x_, &start_v_, &stage_x_, &stage_v_, &net_})
    field->assign(size, 0.0);
  for (Field& field : stage_a_) field.assign(size, 0.0);
  for (int i = 0; i < cloth.count(); ++i) {
    const double mass = cloth.mass_kg()[i];
    inverse_mass_.push_back(mass > 0 ? 1 / mass : 0.0);
    if (!(mass > 0)) no_cloth_.push_back(i);
  }
  touch_of_.assign(cloth.count(), -1);
  clear_until_.assign(cloth.count(), 0.0);
  inside_.reserve(cloth.count());
  paths_m_.assign(cloth.count(), 0.0);
  touching_.reserve(cloth.count());
}

void Motion::hold(const std::vector<Hold>& holds) {
  holds_ = holds;
  const auto count = static_cast<Eigen::Index>(holds.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      for (int k = 0; k < 4; ++k) {
        for (int l = 0; l < 4; ++l) {
          if (holds[i].particle[k] != holds[j].particle[l]) continue;
          gram(i, j) +=
              holds[i].weight[k] * holds[j].weight[l] * inverse_mass_[holds[i].particle[k]];
        }
      }
    }
  }
  if (count > 0) hold_response_ = gram.completeOrthogonalDecomposition().pseudoInverse();
  hold_rate_ = Eigen::Matrix3Xd::Zero(3, count);
  hold_value_.resize(count);
  hold_answer_.resize(count);
}

void Motion::move_holds(const Eigen::Matrix3Xd& rate_m_per_s) {
  hold_rate_ = rate_m_per_s;
  project_holds(velocity, true);
}

Vector3d Motion::held_point(std::size_t hold) const {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k)
    sum += holds_[hold].weight[k] * at(position, holds_[hold].particle[k]);
  return sum;
}

void Motion::project_holds(Field& field, bool to_rate) {
  if (holds_.empty()) return;
  const std::size_t n = field.size() / 3;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t h = 0; h < holds_.size(); ++h) {
      double value = to_rate ? -hold_rate_(axis, static_cast<Eigen::Index>(h)) : 0.0;
      for (int k = 0; k < 4; ++k) {
        value += holds_[h].weight[k] * field[axis * n + holds_[h].particle[k]];
      }
      hold_value_[static_cast<Eigen::Index>(h)] = value;
    }
    hold_answer_.noalias() = hold_response_ * hold_value_;
    for (std::size_t h = 0; h < holds_.size(); ++h) {
      for (int k = 0; k < 4; ++k) {
        const int i = holds_[h].particle[k];
        field[axis * n + i] -=
            inverse_mass_[i] * holds_[h].weight[k] * hold_answer_[static_cast<Eigen::Index>(h)];
      }
    }
  }
}

int Motion::push_out() {
  int moved = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    bool inside = false;
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      const Vector3d p = at(position, i);
      const double gap = surroundings_.gap_m(shape, p);
      if (gap >= 0) continue;
      put_at(position, i, p - gap * surroundings_.normal(shape, p));
      inside = true;
    }
    moved += inside;
  }
  return moved;
}

OuterForces Motion::outer_forces() const {
  return {options_.gravity_m_per_s2, options_.damping_per_s, options_.air_drag_kg_per_m3};
}

void Motion::accelerate(const Field& x, const Field& v, Field& a) {
  std::fill(a.begin(), a.end(), 0.0);
  cloth_.add_forces(x, &v, a);
  if (options_.contact_between_particles) line_contacts_.add_forces(x, &v, a);
  pair_contacts_.add_forces(x, &v, a);
  forces_to_accelerations(outer_forces(), cloth_.area_m2(), inverse_mass_, v, a);
  for (const int i : no_cloth_) put_at(a, i, Vector3d::Zero());
}

void Motion::settle_touches(const Field& a) {
  for (std::size_t k = 0; k < touching_.size();) {
    Touch& touch = touching_[k];
    const Vector3d pull = at(a, touch.particle);
    const double outward = pull.dot(touch.normal);
    if (outward > 0) {
      touch_of_[touch.particle] = -1;
      touching_[k] = touching_.back();
      touching_.pop_back();
      if (k < touching_.size()) touch_of_[touching_[k].particle] = static_cast<int>(k);
      continue;
    }
    if (touch.stuck) {
      const Vector3d along = pull - outward * touch.normal;
      const double size = along.norm();
      if (size > -options_.friction * outward) {
        touch.stuck = false;
        touch.slide = along / size;
      }
    }
    ++k;
  }
}

void Motion::constrain(Field& a) const {
  for (const Touch& touch : touching_) {
    Vector3d pull = at(a, touch.particle);
    const double outward = pull.dot(touch.normal);
    if (touch.stuck) {
      pull.setZero();
    } else if (outward < 0) {
      pull += -outward * touch.normal + options_.friction * outward * touch.slide;
    }
    put_at(a, touch.particle, pull);
  }
}

void Motion::runge_kutta(double dt) {
  // The first of stage_a_ is the constrained acceleration at the start.
  axpy(start_x_, 0.5 * dt, start_v_, stage_x_);
  axpy(start_v_, 0.5 * dt, stage_a_[0], stage_v_);
  for (int stage = 1; stage < 4; ++stage) {
    Field& a = stage_a_[stage];
    accelerate(stage_x_, stage_v_, a);
    constrain(a);
    project_holds(a);
    if (stage < 3)
      runge_kutta_stage({start_x_, start_v_, a, stage_x_, stage_v_}, stage == 1 ? 0.5 * dt : dt);
  }
  runge_kutta_end(start_x_, start_v_, stage_a_, dt, position, velocity);
}

/// Distances change by at most the path of the fastest particle, so a particle far from everything
/// is checked again only when that path has been used up.
double Motion::first_impact(double& fraction) {
  double deepest = 0;
  fraction = 1;
  inside_.clear();
  for (int i = 0; i < cloth_.count(); ++i) {
    if (touch_of_[i] >= 0 || clear_until_[i] > path_m_ + kClearMargin) continue;
    if (inverse_mass_[i] == 0) continue;
    const Vector3d p = at(position, i);
    double least = 1e9;
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      const double gap = surroundings_.gap_m(shape, p);
      least = std::min(least, gap);
      if (gap >= -kImpactDepth) continue;
      const double before = std::max(0.0, surroundings_.gap_m(shape, at(start_x_, i)));
      deepest = std::max(deepest, -gap);
      fraction = std::min(fraction, before / (before - gap));
    }
    if (least < 0) inside_.push_back(i);
    clear_until_[i] = path_m_ + std::max(0.0, least);
  }
  fraction = std::max(fraction, kShortestFraction);
  return deepest;
}

void Motion::land() {
  for (const int i : inside_) {
    const Vector3d p = at(position, i);
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      const double gap = surroundings_.gap_m(shape, p);
      if (gap > 0) continue;
      const Vector3d normal = surroundings_.normal(shape, p);
      Vector3d v = at(velocity, i);
      if (v.dot(normal) >= 0) continue;
      v -= v.dot(normal) * normal;
      const double speed = v.norm();
      Touch touch{i, shape, speed == 0, gap, normal, Vector3d::Zero()};
      if (speed > 0) touch.slide = v / speed;
      put_at(velocity, i, v);
      touch_of_[i] = static_cast<int>(touching_.size());
      touching_.push_back(touch);
      break;
    }
  }
}

void Motion::follow_surfaces(double step_s) {
  const double keep = std::exp(-step_s / kSurfacing);
  for (std::size_t k = 0; k < touching_.size();) {
    Touch& touch = touching_[k];
    Vector3d p = at(position, touch.particle);
    Vector3d v = at(velocity, touch.particle);
    const double gap = surroundings_.gap_m(touch.shape, p);
    touch.normal = surroundings_.normal(touch.shape, p);
    if (gap - touch.gap > kLiftGap && v.dot(touch.normal) > 0) {
      touch_of_[touch.particle] = -1;
      touching_[k] = touching_.back();
      touching_.pop_back();
      if (k < touching_.size()) touch_of_[touching_[k].particle] = static_cast<int>(k);
      continue;
    }
    touch.gap *= keep;
    p -= (gap - touch.gap) * touch.normal;
    v -= v.dot(touch.normal) * touch.normal;
    for (int shape = 0; shape < surroundings_.count(); ++shape) {
      if (shape == touch.shape) continue;
      const double other = surroundings_.gap_m(shape, p);
      if (other >= 0) continue;
      touch.shape = shape;
      touch.normal = surroundings_.normal(shape, p);
      touch.gap = other;
      v -= v.dot(touch.normal) * touch.normal;
      break;
    }
    const double speed = v.norm();
    // Friction has stopped the particle when its velocity has turned round within the step.
    touch.stuck = touch.stuck || speed == 0 || (options_.friction > 0 && v.dot(touch.slide) <= 0);
    if (touch.stuck) v.setZero();
    touch.slide = touch.stuck ? Vector3d(Vector3d::Zero()) : Vector3d(v / speed);
    put_at(position, touch.particle, p);
    put_at(velocity, touch.particle, v);
    ++k;
  }
}

void Motion::book_losses(double step_s) {
  const Speeds speeds =
      sum_speeds(outer_forces(), cloth_.area_m2(), cloth_.mass_kg(), velocity, step_s, paths_m_);
  step_kinetic_j_ = speeds.kinetic_j;
  viscous_loss_j_ += speeds.power_w * step_s;
  last_path_m_ = std::sqrt(speeds.fastest2) * step_s;
  travel_m_ += last_path_m_;
  path_m_ += last_path_m_;
}

void Motion::refresh_line_contacts() {
  // A place that is found again while the sheet already presses there brings elastic energy in.
  const double before_j = line_contacts_.energy_j(position);
  line_contacts_.refresh(position, paths_m_);
  found_contacts_j_ += line_contacts_.energy_j(position) - before_j;
  travel_m_ = 0;
}

void Motion::seek_contacts() {
  if (!options_.contact_between_particles) return;
  line_contacts_.look_everywhere();
  refresh_line_contacts();
  found_contacts_j_ += line_contacts_.settle(position);
}

void Motion::watch_contacts() {
  const double margin = 2 * last_path_m_ + kChooseMargin;
  if (options_.contact_between_particles) {
    if (steps_ % kRefreshSteps == 0 || travel_m_ > kRefreshTravel) refresh_line_contacts();
    line_contacts_.choose(position, path_m_, margin);
    if (steps_ % kFollowSteps == 0) found_contacts_j_ += line_contacts_.follow(position);
  }
  pair_contacts_.watch(position, path_m_, margin);
}

/// Particles on an object pass what they take over on to it.
void Motion::land_pairs() {
  if (pair_contacts_.near() == 0) return;
  mobility_ = inverse_mass_;
  for (const Touch& touch : touching_) mobility_[touch.particle] = 0;
  pair_contacts_.land(position, inverse_mass_, mobility_, velocity);
}

double Motion::step(double step_s) {
  watch_contacts();
  ++steps_;
  if (last_path_m_ > pair_contacts_.longest_path_m())
    step_s = std::min(step_s, last_step_s_ * pair_contacts_.longest_path_m() / last_path_m_);
  // Many pairs may come to press between two looks at the limit.
  const double grown = pair_contacts_.frequency_squared_per_s2() - bound_of_pairs_per_s2_;
  if (grown > 0 && bound_per_s2_ > 0) step_s *= std::sqrt(bound_per_s2_ / (bound_per_s2_ + grown));
  start_x_ = position;
  start_v_ = velocity;
  accelerate(start_x_, start_v_, stage_a_[0]);
  settle_touches(stage_a_[0]);
  constrain(stage_a_[0]);
  project_holds(stage_a_[0]);
  runge_kutta(step_s);
  double fraction = 1;
  const double deepest = first_impact(fraction);
  if (deepest <= kImpactDepth) fraction = 1;
  fraction = std::min(fraction, pair_contacts_.first_impact(start_x_, position, kImpactDepth));
  if (fraction < 1) {
    ++backtracked_;
    step_s *= std::max(fraction, kShortestFraction);
    runge_kutta(step_s);
    (void)first_impact(fraction);
  }
  follow_surfaces(step_s);
  land();
  land_pairs();
  project_holds(velocity, true);
  if (options_.contact_between_particles) line_contacts_.advance(position, velocity, step_s);
  pair_contacts_.advance(position, velocity, step_s);
  cloth_.settle(position);
  book_losses(step_s);
  last_step_s_ = step_s;
  return step_s;
}

void Motion::stop() {
  stopped_j_ += kinetic_energy_j();
  std::fill(velocity.begin(), velocity.end(), 0.0);
  for (Touch& touch : touching_) {
    touch.stuck = true;
    touch.slide.setZero();
  }
}

double Motion::stable_step_s(double fraction) {
  double bound = cloth_.stiffness_bound_per_s2(cloth_.strains(position));
  if (options_.contact_between_particles) {
    bound += kLineContactFactor * line_contacts_.frequency_squared_per_s2();
  }
  bound_of_pairs_per_s2_ = kPairFactor * pair_contacts_.frequency_squared_per_s2();
  bound_per_s2_ = bound + bound_of_pairs_per_s2_;
  return fraction * kRk4ImaginaryLimit / std::sqrt(bound_per_s2_);
}

double Motion::kinetic_energy_j() const {
  const std::size_t n = inverse_mass_.size();
  const std::vector<double>& mass = cloth_.mass_kg();
  double twice = 0;
  for (std::size_t i = 0; i < n; ++i) {
    twice += mass[i] * (velocity[i] * velocity[i] + velocity[n + i] * velocity[n + i] +
                        velocity[2 * n + i] * velocity[2 * n + i]);
  }
  return 0.5 * twice;
}

double Motion::gravity_energy_j() const {
  double sum = 0;
  for (int i = 0; i < cloth_.count(); ++i) {
    sum -= cloth_.mass_kg()[i] * at(position, i).dot(options_.gravity_m_per_s2);
  }
  return sum;
}

double Motion::residual() {
  std::fill(net_.begin(), net_.end(), 0.0);
  cloth_.add_forces(position, nullptr, net_);
  if (options_.contact_between_particles) {
    line_contacts_.choose_all();
    line_contacts_.add_forces(position, nullptr, net_);
  }
  pair_contacts_.watch(position, path_m_, kChooseMargin);
  pair_contacts_.add_forces(position, nullptr, net_);
  const int n = cloth_.count();
  for (int i = 0; i < n; ++i) {
    Vector3d pull = at(net_, i) * inverse_mass_[i] + options_.gravity_m_per_s2;
    if (touch_of_[i] >= 0) {
      const Vector3d& normal = touching_[touch_of_[i]].normal;
      const double outward = pull.dot(normal);
      if (outward < 0) {
        pull -= outward * normal;
        const double size = pull.norm();
        const double held = -options_.friction * outward;
        pull *= size <= held ? 0.0 : 1 - held / size;
      }
    }
    put_at(net_, i, pull);
  }
  for (const int i : no_cloth_) put_at(net_, i, Vector3d::Zero());
  project_holds(net_);
  double largest = 0;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double force = at(net_, i).norm() * cloth_.mass_kg()[i];
    largest = std::max(largest, force);
    sum += force * force;
  }
  const auto whole = static_cast<double>(n - static_cast<int>(no_cloth_.size()));
  const double weight = cloth_.total_mass_kg() * options_.gravity_m_per_s2.norm() / whole;
  residual_rms_ = std::sqrt(sum / whole) / weight;
  return largest / weight;
}

}  // namespace drape::simulate

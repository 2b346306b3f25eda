// SPDX-License-Identifier: Apache-2.0
#include "simulate/paper/paper_motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kRk4ImaginaryLimit = 2.828;
constexpr double kImpactDepth = 10e-6;  // m; shallower hits do not end the step early
constexpr double kClearMargin = 1e-3;   // m; covers the path of a step and released particles
constexpr double kSurfacing = 2e-3;     // s; time constant for lifting a shallow hit to the surface
constexpr double kLiftGap = 1e-6;       // m; a touching particle farther out has left
constexpr double kShortestFraction = 0.02;  // for a step that ends early at an impact

}  // namespace

PaperMotion::PaperMotion(const PaperCloth& cloth, const Surroundings& around,
                         const PaperForces& forces)
    : cloth_(cloth),
      around_(around),
      forces_(forces),
      layers_(cloth.grid(), cloth.particle_kg(), forces.gravity_m_per_s2.norm(),
              forces.thickness_m) {
  const int n = cloth.grid().count();
  position = velocity = Particles::Zero(3, n);
  a_.fill(Particles::Zero(3, n));
  area_per_mass_.resize(n);
  for (int i = 0; i < n; ++i) area_per_mass_[i] = cloth.area_m2(i) / cloth.particle_kg();
  touch_.resize(n);
  clear_until_.assign(n, 0.0);
}

void PaperMotion::hold(const Eigen::MatrixXd& weights) {
  holds_ = weights;
  hold_response_ = weights.completeOrthogonalDecomposition().pseudoInverse();
  hold_rate_ = Eigen::Matrix3Xd::Zero(3, weights.rows());
}

void PaperMotion::move_holds(const Eigen::Matrix3Xd& rate_m_per_s) {
  hold_rate_ = rate_m_per_s;
  project_holds(velocity, &hold_rate_);
}

/// Removes from the values the motion of held points that differs from `rate`; all particles have
/// equal mass.
void PaperMotion::project_holds(Particles& values, const Eigen::Matrix3Xd* rate) const {
  if (holds_.rows() == 0) return;
  Eigen::Matrix3Xd wrong = values * holds_.transpose();
  if (rate != nullptr) wrong -= *rate;
  values -= wrong * hold_response_.transpose();
}

int PaperMotion::push_out() {
  int moved = 0;
  for (Eigen::Index i = 0; i < position.cols(); ++i) {
    const Vector3d before = position.col(i);
    for (int shape = 0; shape < around_.count(); ++shape) {
      const Vector3d p = position.col(i);
      const double gap = around_.gap_m(shape, p);
      if (gap < 0) position.col(i) -= gap * around_.normal(shape, p);
    }
    moved += position.col(i) != before;
  }
  return moved;
}

CertificateStrains PaperMotion::accelerate(const Particles& x, const Particles& v,
                                           Particles& a) const {
  a.setZero();
  const CertificateStrains strains = cloth_.add_forces(x, &v, a);
  layers_.add_forces(x, &v, a);
  a = (a / cloth_.particle_kg()).colwise() + forces_.gravity_m_per_s2;
  for (Eigen::Index i = 0; i < a.cols(); ++i)
    a.col(i) -=
        (forces_.damping_per_s + forces_.air_drag_kg_per_m3 * area_per_mass_[i] * v.col(i).norm()) *
        v.col(i);
  return strains;
}

/// Releases particles pulled off their surface, and lets others slide if friction cannot hold them.
void PaperMotion::settle_touches(const Particles& a) {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    const Vector3d pull = a.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch.normal);
    if (outward > 0) {
      touch.shape = -1;
      continue;
    }
    touch.press_m_per_s2 = -outward;
    const Vector3d along = pull - outward * touch.normal;
    if (touch.stuck && along.norm() > -forces_.friction * outward) {
      touch.stuck = false;
      touch.slide = along.normalized();
    }
  }
}

void PaperMotion::constrain(Particles& a) const {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    const Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    auto pull = a.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch.normal);
    if (touch.stuck) {
      pull.setZero();
    } else if (outward < 0) {
      pull += -outward * touch.normal + forces_.friction * outward * touch.slide;
    }
  }
}

/// Starts from start_x_, start_v_ and the constrained acceleration there, a_[0].
void PaperMotion::runge_kutta(double dt) {
  Particles x = start_x_ + 0.5 * dt * start_v_, v = start_v_ + 0.5 * dt * a_[0];
  for (int stage = 1; stage < 4; ++stage) {
    (void)accelerate(x, v, a_[stage]);
    constrain(a_[stage]);
    project_holds(a_[stage]);
    if (stage == 3) break;
    const double reach = stage == 1 ? 0.5 * dt : dt;
    x = start_x_ + reach * v;
    v = start_v_ + reach * a_[stage];
  }
  position = start_x_ + dt * start_v_ + dt * dt / 6 * (a_[0] + a_[1] + a_[2]);
  velocity = start_v_ + dt / 6 * (a_[0] + 2 * a_[1] + 2 * a_[2] + a_[3]);
}

/// Fraction of the step at which the first particle reaches a surface; 1 if none gets deeper than a
/// shallow hit. Distances change by at most the path of the fastest particle, so a distant particle
/// is tested again only once that path is used up.
double PaperMotion::first_impact() {
  double fraction = 1;
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape >= 0 || clear_until_[i] > path_m_ + kClearMargin) continue;
    const auto column = static_cast<Eigen::Index>(i);
    double least = 1e9;
    for (int shape = 0; shape < around_.count(); ++shape) {
      const double gap = around_.gap_m(shape, position.col(column));
      least = std::min(least, gap);
      if (gap >= -kImpactDepth) continue;
      const double before = std::max(0.0, around_.gap_m(shape, start_x_.col(column)));
      fraction = std::min(fraction, before / (before - gap));
    }
    clear_until_[i] = path_m_ + std::max(0.0, least);
  }
  return std::max(fraction, kShortestFraction);
}

/// Sets the normal velocity of particles that have reached a surface to zero.
void PaperMotion::land() {
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape >= 0 || clear_until_[i] > path_m_) continue;
    const auto column = static_cast<Eigen::Index>(i);
    const Vector3d p = position.col(column);
    for (int shape = 0; shape < around_.count(); ++shape) {
      const double gap = around_.gap_m(shape, p);
      if (gap > 0) continue;
      const Vector3d normal = around_.normal(shape, p);
      const double into = velocity.col(column).dot(normal);
      if (into >= 0) continue;
      velocity.col(column) -= into * normal;
      const double speed = velocity.col(column).norm();
      touch_[i] = {shape, speed == 0, 0, gap, normal, Vector3d::Zero()};
      if (speed > 0) touch_[i].slide = velocity.col(column) / speed;
      break;
    }
  }
}

void PaperMotion::follow_surfaces(double step_s) {
  const double keep = std::exp(-step_s / kSurfacing);
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    Touch& touch = touch_[i];
    if (touch.shape < 0) continue;
    const auto column = static_cast<Eigen::Index>(i);
    Vector3d p = position.col(column), v = velocity.col(column);
    const double gap = around_.gap_m(touch.shape, p);
    touch.normal = around_.normal(touch.shape, p);
    if (gap - touch.gap > kLiftGap && v.dot(touch.normal) > 0) {
      touch.shape = -1;
      continue;
    }
    touch.gap *= keep;
    p -= (gap - touch.gap) * touch.normal;
    v -= v.dot(touch.normal) * touch.normal;
    for (int shape = 0; shape < around_.count(); ++shape) {
      if (shape == touch.shape) continue;
      const double other = around_.gap_m(shape, p);
      if (other >= 0) continue;
      touch.shape = shape;
      touch.normal = around_.normal(shape, p);
      touch.gap = other;
      v -= v.dot(touch.normal) * touch.normal;
      break;
    }
    const double speed = v.norm();
    // Friction with a fixed direction during a step makes slow particles oscillate with growing
    // amplitude; one that it would stop within half a step, or has reversed, sticks.
    touch.stuck = touch.stuck || speed <= 0.5 * forces_.friction * touch.press_m_per_s2 * step_s ||
                  (forces_.friction > 0 && v.dot(touch.slide) <= 0);
    if (touch.stuck) v.setZero();
    touch.slide = touch.stuck ? Vector3d(Vector3d::Zero()) : Vector3d(v / speed);
    position.col(column) = p;
    velocity.col(column) = v;
  }
}

double PaperMotion::step(double fraction, double longest_s) {
  layers_.follow(position);
  start_x_ = position;
  start_v_ = velocity;
  const CertificateStrains strains = accelerate(start_x_, start_v_, a_[0]);
  double step_s = std::min(longest_s, fraction * kRk4ImaginaryLimit /
                                          std::sqrt(cloth_.stiffness_bound_per_s2(strains) +
                                                    layers_.stiffness_bound_per_s2()));
  settle_touches(a_[0]);
  constrain(a_[0]);
  project_holds(a_[0]);
  runge_kutta(step_s);
  const double impact = first_impact();
  if (impact < 1) {
    ++backtracked_;
    step_s *= impact;
    runge_kutta(step_s);
    (void)first_impact();
  }
  follow_surfaces(step_s);
  land();
  project_holds(velocity, &hold_rate_);
  double fastest = 0;
  for (Eigen::Index i = 0; i < velocity.cols(); ++i) {
    const double speed = velocity.col(i).norm();
    fastest = std::max(fastest, speed);
    viscous_j_ += cloth_.particle_kg() * step_s * speed * speed *
                  (forces_.damping_per_s + forces_.air_drag_kg_per_m3 * area_per_mass_[i] * speed);
  }
  path_m_ += fastest * step_s;
  return step_s;
}

void PaperMotion::stop() {
  velocity.setZero();
  for (Touch& touch : touch_) {
    touch.stuck = true;
    touch.slide.setZero();
  }
}

double PaperMotion::kinetic_j() const {
  return 0.5 * cloth_.particle_kg() * velocity.squaredNorm();
}

double PaperMotion::gravity_j() const {
  return -cloth_.particle_kg() * forces_.gravity_m_per_s2.dot(position.rowwise().sum());
}

double PaperMotion::residual() const {
  Particles net = Particles::Zero(3, position.cols());
  (void)cloth_.add_forces(position, nullptr, net);
  layers_.add_forces(position, nullptr, net);
  net = (net / cloth_.particle_kg()).colwise() + forces_.gravity_m_per_s2;
  for (std::size_t i = 0; i < touch_.size(); ++i) {
    if (touch_[i].shape < 0) continue;
    auto pull = net.col(static_cast<Eigen::Index>(i));
    const double outward = pull.dot(touch_[i].normal);
    if (outward >= 0) continue;
    pull -= outward * touch_[i].normal;
    const double size = pull.norm(), held = -forces_.friction * outward;
    pull *= size <= held ? 0.0 : 1 - held / size;
  }
  project_holds(net);
  return std::sqrt(net.colwise().squaredNorm().maxCoeff()) / forces_.gravity_m_per_s2.norm();
}

int PaperMotion::contacts() const {
  return static_cast<int>(std::count_if(touch_.begin(), touch_.end(),
                                        [](const Touch& touch) { return touch.shape >= 0; }));
}

}  // namespace drape::simulate

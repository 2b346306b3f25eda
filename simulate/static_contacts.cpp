// SPDX-License-Identifier: Apache-2.0
#include "simulate/static_contacts.hpp"

#include <algorithm>
#include <cmath>

namespace drape::sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A sliding particle is moved until friction holds it with this share of its limit, so that it
// sticks then: sliding ends after finitely many steps.
constexpr double kComeToRest = 0.98;
constexpr double kOnSurface = 1e-9;      // m; touching particles nearer need no lifting
constexpr double kWasOn = 1e-6;          // m; below, a particle lay on the surface
constexpr double kPinOverStretch = 100;  // stiffness of a pin over that of the springs
constexpr double kNormalStep = 1e-7;     // m; for the curvature of a surface
constexpr double kConeRoundOff = 1e-12;

Vector3d at(const Field& x, int i) {
  const std::size_t n = x.size() / 3;
  return {x[i], x[n + i], x[2 * n + i]};
}

void add_at(Field& x, int i, const Vector3d& value) {
  const std::size_t n = x.size() / 3;
  x[i] += value.x();
  x[n + i] += value.y();
  x[2 * n + i] += value.z();
}

template <class Mixture>
Vector3d mix(const Field& field, const Mixture& point) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] != 0) sum += point.weight[k] * at(field, point.particle[k]);
  }
  return sum;
}

template <class Mixture>
void add_mixture(const Mixture& point, const Matrix3d& block, GridMatrix& hessian) {
  for (int k = 0; k < 4; ++k) {
    if (point.weight[k] == 0) continue;
    for (int l = 0; l <= k; ++l) {
      if (point.weight[l] == 0) continue;
      hessian.add(point.particle[k], point.particle[l], point.weight[k] * point.weight[l] * block);
    }
  }
}

/// Second derivative of the distance from a shape.
Matrix3d distance_curvature(const Surroundings& surroundings, int shape, const Vector3d& p) {
  Matrix3d sum;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kNormalStep * Vector3d::Unit(axis);
    sum.col(axis) = (surroundings.normal(shape, p + step) - surroundings.normal(shape, p - step)) /
                    (2 * kNormalStep);
  }
  return 0.5 * (sum + sum.transpose());
}

}  // namespace

StaticContacts::StaticContacts(const Cloth& cloth, const Surroundings& surroundings,
                               double friction, double gravity_m_per_s2, bool between_particles)
    : cloth_(&cloth),
      surroundings_(&surroundings),
      friction_(friction),
      between_particles_(between_particles),
      lines_(cloth, surroundings, friction, gravity_m_per_s2),
      touch_(cloth.count(), Touch::none),
      shape_(cloth.count(), -1),
      way_(cloth.count(), Vector3d::Zero()),
      anchor_(lines_.elements(), Vector3d::Zero()),
      anchored_(lines_.elements(), 0),
      projector_(cloth.count(), Matrix3d::Identity()),
      restricted_(cloth.count(), 0),
      lift_(Eigen::VectorXd::Zero(3 * cloth.count())),
      sliding_friction_(Eigen::VectorXd::Zero(3 * cloth.count())) {}

void StaticContacts::hold(const std::vector<Hold>& holds, const std::vector<Vector3d>& in_world) {
  holds_ = holds;
  hold_in_world_ = in_world;
  hold_force_.assign(holds.size(), Vector3d::Zero());
  hold_stiffness_ =
      kPinOverStretch * std::max(cloth_->laws().tensile[0].slope, cloth_->laws().tensile[1].slope);
}

void StaticContacts::touch_what_lies_on(const Field& position, double reach_m) {
  for (int i = 0; i < cloth_->count(); ++i) {
    touch_[i] = Touch::none;
    for (int shape = 0; shape < surroundings_->count(); ++shape) {
      if (surroundings_->gap_m(shape, at(position, i)) > reach_m) continue;
      touch_[i] = Touch::stuck;
      shape_[i] = shape;
      break;
    }
  }
}

StaticContacts::Contact StaticContacts::contact(const LineContacts::Point& point,
                                                const Field& position) const {
  Contact result;
  const Vector3d p = mix(position, point);
  result.gap = surroundings_->gap_m(point.shape, p);
  if (result.gap >= 0) return result;
  result.normal = surroundings_->normal(point.shape, p);
  result.normal_n = -lines_.stiffness_n_per_m() * result.gap;
  result.spring.setZero();
  if (anchored_[point.element] != 0) result.spring = p - anchor_[point.element];
  result.spring -= result.spring.dot(result.normal) * result.normal;
  result.tangential_n = -lines_.stiffness_n_per_m() * result.spring;
  const double limit = friction_ * result.normal_n;
  const double size = result.tangential_n.norm();
  if (size > limit) {
    result.slips = true;
    result.tangential_n *= limit / size;
  }
  return result;
}

void StaticContacts::refresh(const Field& position) {
  if (!between_particles_) return;
  std::vector<Vector3d> spring(anchor_.size(), Vector3d::Zero());
  std::vector<char> had(anchor_.size(), 0);
  for (const LineContacts::Point& point : lines_.points()) {
    if (anchored_[point.element] == 0) continue;
    const Vector3d p = mix(position, point);
    if (surroundings_->gap_m(point.shape, p) >= 0) continue;
    had[point.element] = 1;
    spring[point.element] = p - anchor_[point.element];
  }
  lines_.refresh(position);
  std::fill(anchored_.begin(), anchored_.end(), 0);
  for (const LineContacts::Point& point : lines_.points()) {
    const Vector3d p = mix(position, point);
    if (surroundings_->gap_m(point.shape, p) >= 0) continue;
    anchored_[point.element] = 1;
    anchor_[point.element] = p;
    if (had[point.element] != 0) anchor_[point.element] -= spring[point.element];
  }
}

void StaticContacts::yield(const Field& position) {
  for (const LineContacts::Point& point : lines_.points()) {
    const Contact c = contact(point, position);
    if (c.gap >= 0) {
      anchored_[point.element] = 0;
      continue;
    }
    const Vector3d p = mix(position, point);
    if (anchored_[point.element] == 0) anchor_[point.element] = p;
    anchored_[point.element] = 1;
    if (!c.slips) continue;
    anchor_[point.element] = p + kComeToRest * c.tangential_n / lines_.stiffness_n_per_m();
  }
}

void StaticContacts::add_forces(const Field& position, Field& force) const {
  const auto spread = [&](const auto& point, const Vector3d& total) {
    for (int k = 0; k < 4; ++k) {
      if (point.weight[k] != 0) add_at(force, point.particle[k], point.weight[k] * total);
    }
  };
  for (const LineContacts::Point& point : lines_.points()) {
    const Contact c = contact(point, position);
    if (c.gap < 0) spread(point, c.normal_n * c.normal + c.tangential_n);
  }
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    spread(holds_[h],
           hold_force_[h] + hold_stiffness_ * (hold_in_world_[h] - mix(position, holds_[h])));
  }
}

void StaticContacts::add_hessian(const Field& position, bool convex, GridMatrix& hessian) const {
  const double stiffness = lines_.stiffness_n_per_m();
  for (const LineContacts::Point& point : lines_.points()) {
    const Contact c = contact(point, position);
    if (c.gap >= 0) continue;
    const Matrix3d across = Matrix3d::Identity() - c.normal * c.normal.transpose();
    Matrix3d block = stiffness * c.normal * c.normal.transpose();
    if (!c.slips && friction_ > 0) block += stiffness * across;
    if (c.slips) {
      const Vector3d way = c.spring.normalized();
      block += friction_ * c.normal_n / c.spring.norm() * (across - way * way.transpose());
    }
    if (!convex) {
      block +=
          stiffness * c.gap * distance_curvature(*surroundings_, point.shape, mix(position, point));
    }
    add_mixture(point, block, hessian);
  }
  for (const Hold& hold : holds_) {
    add_mixture(hold, hold_stiffness_ * Matrix3d::Identity(), hessian);
  }
}

void StaticContacts::set_constraint(int i, const Field& position, bool all_directions) {
  const Vector3d p = at(position, i);
  const Vector3d normal = surroundings_->normal(shape_[i], p);
  restricted_[i] = 1;
  projector_[i] = all_directions ? Matrix3d(Matrix3d::Zero())
                                 : Matrix3d(Matrix3d::Identity() - normal * normal.transpose());
  Vector3d lift = Vector3d::Zero();
  for (int shape = 0; shape < surroundings_->count(); ++shape) {
    const double gap = surroundings_->gap_m(shape, p);
    if (shape == shape_[i] ? std::abs(gap) > kOnSurface : gap < -kOnSurface) {
      lift -= gap * surroundings_->normal(shape, p);
    }
  }
  lift_.segment<3>(3 * i) = lift;
}

double StaticContacts::settle(const Field& position, const Field& force) {
  double largest = 0;
  double squares = 0;
  for (int i = 0; i < cloth_->count(); ++i) {
    restricted_[i] = 0;
    projector_[i].setIdentity();
    lift_.segment<3>(3 * i).setZero();
    sliding_friction_.segment<3>(3 * i).setZero();
    Vector3d pull = at(force, i);
    if (touch_[i] != Touch::none) {
      const Vector3d normal = surroundings_->normal(shape_[i], at(position, i));
      const double outward = pull.dot(normal);
      if (touch_[i] == Touch::landing) {
        set_constraint(i, position, false);
        touch_[i] = Touch::sliding;
        way_[i].setZero();
        pull -= outward * normal;
      } else if (outward > 0) {
        touch_[i] = Touch::none;
      } else {
        pull -= outward * normal;
        const double held = -friction_ * outward;
        const double size = pull.norm();
        const bool within = size <= held * (1 + kConeRoundOff) && friction_ > 0;
        // What slides goes on until it turns back: otherwise two neighbours take turns for ever.
        if (touch_[i] == Touch::stuck || way_[i].isZero(0)) {
          touch_[i] = within ? Touch::stuck : Touch::sliding;
          way_[i] = within ? Vector3d(Vector3d::Zero()) : Vector3d(pull / size);
        }
        const bool sticks = touch_[i] == Touch::stuck;
        set_constraint(i, position, sticks);
        if (!sticks) {
          const Vector3d way = way_[i] - way_[i].dot(normal) * normal;
          sliding_friction_.segment<3>(3 * i) = -kComeToRest * held * way;
        }
        pull *= within ? 0.0 : 1 - held / size;
      }
    }
    const double net = pull.norm();
    largest = std::max(largest, net);
    squares += net * net;
  }
  rms_n_ = std::sqrt(squares / cloth_->count());
  return std::isfinite(rms_n_) ? largest : rms_n_;
}

void StaticContacts::add_surface_curvature(const Field& position, const Field& force,
                                           GridMatrix& hessian) const {
  for (int i = 0; i < cloth_->count(); ++i) {
    if (touch_[i] != Touch::sliding) continue;
    const Vector3d p = at(position, i);
    const double outward = at(force, i).dot(surroundings_->normal(shape_[i], p));
    hessian.add(i, i, outward * distance_curvature(*surroundings_, shape_[i], p));
  }
}

int StaticContacts::catch_entering(const Field& from, const Field& to, double deep_m) {
  int caught = 0;
  for (int i = 0; i < cloth_->count(); ++i) {
    if (touch_[i] != Touch::none) continue;
    const Vector3d p = at(to, i);
    for (int shape = 0; shape < surroundings_->count(); ++shape) {
      if (surroundings_->gap_m(shape, p) >= -deep_m) continue;
      touch_[i] = Touch::landing;
      shape_[i] = shape;
      set_constraint(i, from, false);
      touch_[i] = Touch::sliding;
      way_[i].setZero();
      ++caught;
      break;
    }
  }
  return caught;
}

void StaticContacts::retract(const Field& from, Field& to) const {
  for (int i = 0; i < cloth_->count(); ++i) {
    if (touch_[i] != Touch::sliding) continue;
    if (surroundings_->gap_m(shape_[i], at(from, i)) > kWasOn) continue;
    const Vector3d p = at(to, i);
    add_at(to, i, -surroundings_->gap_m(shape_[i], p) * surroundings_->normal(shape_[i], p));
  }
}

void StaticContacts::follow(const Field& from, const Field& position) {
  for (int i = 0; i < cloth_->count(); ++i) {
    const Vector3d p = at(position, i);
    if (touch_[i] == Touch::sliding && (p - at(from, i)).dot(way_[i]) < 0) {
      touch_[i] = Touch::stuck;
    }
    for (int shape = 0; shape < surroundings_->count(); ++shape) {
      if (shape == shape_[i] && touch_[i] != Touch::none) continue;
      if (surroundings_->gap_m(shape, p) >= -kOnSurface) continue;
      shape_[i] = shape;
      touch_[i] = Touch::landing;
      break;
    }
  }
}

void StaticContacts::update_pins(const Field& position) {
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    hold_force_[h] += hold_stiffness_ * (hold_in_world_[h] - mix(position, holds_[h]));
  }
}

double StaticContacts::pin_error_m(const Field& position) const {
  double largest = 0;
  for (std::size_t h = 0; h < holds_.size(); ++h) {
    largest = std::max(largest, (hold_in_world_[h] - mix(position, holds_[h])).norm());
  }
  return largest;
}

double StaticContacts::gap_error_m(const Field& position) const {
  double largest = 0;
  for (int i = 0; i < cloth_->count(); ++i) {
    if (touch_[i] == Touch::none) continue;
    largest = std::max(largest, std::abs(surroundings_->gap_m(shape_[i], at(position, i))));
  }
  return largest;
}

double StaticContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const LineContacts::Point& point : lines_.points()) {
    const double gap = surroundings_->gap_m(point.shape, mix(position, point));
    if (gap < 0) sum += 0.5 * lines_.stiffness_n_per_m() * gap * gap;
  }
  return sum;
}

int StaticContacts::touching() const {
  return static_cast<int>(
      std::count_if(touch_.begin(), touch_.end(), [](Touch t) { return t != Touch::none; }));
}

int StaticContacts::sliding() const {
  return static_cast<int>(std::count_if(touch_.begin(), touch_.end(), [](Touch t) {
    return t == Touch::sliding || t == Touch::landing;
  }));
}

}  // namespace drape::sim

// SPDX-License-Identifier: Apache-2.0
// The quadratic model of contact and friction within a step.
#include <algorithm>
#include <cmath>

#include "simulate/equilibrium/contacts.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

}  // namespace

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

/// Whether friction that holds changed between holding and yielding along the path of its place.
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

}  // namespace drape::simulate

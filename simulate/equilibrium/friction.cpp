// SPDX-License-Identifier: Apache-2.0
// Friction's limits that follow the pressing forces within a step. With limits of the step's start
// alone, sliding and pressing approach each other by a factor per step that may be near 1: 164
// steps at 201x201, most of them creeping, became 28.
#include <algorithm>

#include "simulate/equilibrium/contacts.hpp"
#include "simulate/equilibrium/mixture.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kMostChange = 3;  // of a limit in one step, up or down

}  // namespace

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
    // As long as the limit allows: so it slides from the start of the step on.
    contact.anchor = mix(position, contact) - limit / shear_stiffness_ * contact.slide;
    contact.limit = limit;
  }
}

}  // namespace drape::simulate

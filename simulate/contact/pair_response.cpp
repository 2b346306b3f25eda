// SPDX-License-Identifier: Apache-2.0
// How pairs that touch push, stop and hold by friction.
#include <algorithm>
#include <cmath>

#include "simulate/contact/pair_contacts.hpp"

namespace drape::simulate {
namespace {

using Eigen::Vector3d;

constexpr double kFastImpact = 0.02;  // m/s; faster approach is stopped, also of pressed pairs
constexpr double kRestDepth = 10e-6;  // m; nor may deeper pairs approach at all
constexpr int kLandingSweeps = 3;
constexpr double kLeastMobility = 0.1;  // of a place whose particles nothing holds

}  // namespace

std::optional<PairContacts::Push> PairContacts::push(const Pair& pair, const Field& position,
                                                     const Field* velocity) const {
  const std::optional<Meeting> meeting = meet(pair, position);
  if (!meeting || meeting->gap >= 0) return std::nullopt;
  const Vector3d& out = meeting->direction;
  double normal_n = -stiffness_ * meeting->gap;
  Vector3d tangential = -stiffness_ * pair.spring;
  if (velocity != nullptr) {
    const Vector3d rate = mix(pair, *meeting, *velocity);
    normal_n = std::max(0.0, normal_n - damping_ * rate.dot(out));
    tangential -= 0.5 * damping_ * rate;
  }
  tangential -= tangential.dot(out) * out;
  const double limit = friction_ * normal_n;
  const double size = tangential.norm();
  if (size > limit) tangential *= limit / size;
  return Push{*meeting, normal_n * out + tangential};
}

void PairContacts::add_forces(const Field& position, const Field* velocity, Field& force) const {
  const std::size_t n = position.size() / 3;
  for (const int k : chosen_) {
    const Pair& pair = pairs_[k];
    const std::optional<Push> found = push(pair, position, velocity);
    if (!found) continue;
    for (int c = 0; c < 4; ++c) {
      if (pair.node[c] >= count_) continue;
      for (int axis = 0; axis < 3; ++axis)
        force[axis * n + pair.node[c]] += found->meeting.weight[c] * found->force[axis];
    }
  }
}

double PairContacts::first_impact(const Field& start, const Field& end, double depth_m) const {
  double fraction = 1;
  for (const int k : chosen_) {
    if (pairs_[k].pressed) continue;
    const std::optional<Meeting> after = meet(pairs_[k], end);
    if (!after || after->gap >= -depth_m) continue;
    const std::optional<Meeting> before = meet(pairs_[k], start);
    if (!before || before->gap < 0) continue;
    fraction = std::min(fraction, before->gap / (before->gap - after->gap));
  }
  return fraction;
}

void PairContacts::land(const Field& position, const std::vector<double>& whole_inverse_mass,
                        const std::vector<double>& inverse_mass, Field& velocity) {
  const std::size_t n = position.size() / 3;
  for (int sweep = 0; sweep < kLandingSweeps; ++sweep) {
    for (const int k : chosen_) {
      Pair& pair = pairs_[k];
      const std::optional<Meeting> meeting = meet(pair, position);
      if (!meeting || meeting->gap > 0) continue;
      const double approach = -mix(pair, *meeting, velocity).dot(meeting->direction);
      const bool rests = pair.pressed && meeting->gap > -kRestDepth;
      if (approach <= (rests ? kFastImpact : 0.0)) continue;
      double mobility = 0, whole = 0;
      for (int c = 0; c < 4; ++c) {
        if (pair.node[c] >= count_) continue;
        const double square = meeting->weight[c] * meeting->weight[c];
        mobility += square * inverse_mass[pair.node[c]];
        whole += square * whole_inverse_mass[pair.node[c]];
      }
      if (!(mobility > 0)) continue;
      // A particle that barely carries the place cannot stop it for those that are held.
      mobility = std::max(mobility, kLeastMobility * whole);
      for (int c = 0; c < 4; ++c) {
        if (pair.node[c] >= count_) continue;
        const double change = approach / mobility * meeting->weight[c] * inverse_mass[pair.node[c]];
        for (int axis = 0; axis < 3; ++axis)
          velocity[axis * n + pair.node[c]] += change * meeting->direction[axis];
      }
    }
  }
}

void PairContacts::advance(const Field& position, const Field& velocity, double step_s) {
  for (const int k : chosen_) {
    Pair& pair = pairs_[k];
    const std::optional<Meeting> meeting = meet(pair, position);
    if (!meeting) continue;
    if (meeting->gap > -pair.thickness || pair.kind == Kind::solid_corner ||
        pair.kind == Kind::solid_edge) {
      pair.side = meeting->direction;
      pair.known = true;
    }
    pair.pressed = meeting->gap < 0;
    if (!pair.pressed) {
      pair.spring.setZero();
      continue;
    }
    pair.spring += step_s * mix(pair, *meeting, velocity);
    pair.spring -= pair.spring.dot(meeting->direction) * meeting->direction;
    const double limit = -friction_ * meeting->gap;
    const double size = pair.spring.norm();
    if (size > limit) pair.spring *= limit / size;
  }
}

int PairContacts::pressing(const Field& position) const {
  int count = 0;
  for (const Pair& pair : pairs_) {
    const std::optional<Meeting> meeting = meet(pair, position);
    count += meeting && meeting->gap < 0;
  }
  return count;
}

double PairContacts::deepest_solid_m(const Field& position) const {
  double deepest = 0;
  for (const int k : chosen_) {
    const Pair& pair = pairs_[k];
    if (pair.kind != Kind::solid_corner && pair.kind != Kind::solid_edge) continue;
    const std::optional<Meeting> meeting = meet(pair, position);
    if (meeting) deepest = std::max(deepest, -meeting->gap);
  }
  return deepest;
}

double PairContacts::energy_j(const Field& position) const {
  double sum = 0;
  for (const int k : chosen_) {
    const std::optional<Meeting> meeting = meet(pairs_[k], position);
    if (meeting && meeting->gap < 0) sum += 0.5 * stiffness_ * meeting->gap * meeting->gap;
  }
  return sum;
}

}  // namespace drape::simulate

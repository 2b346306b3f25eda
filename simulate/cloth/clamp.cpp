// SPDX-License-Identifier: Apache-2.0
#include "simulate/cloth/clamp.hpp"

#include <algorithm>
#include <cmath>

namespace drape::simulate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double secant_of(const ForceCurve& law, double curvature) {
  return curvature > 0 ? law.value(curvature) / curvature : law.slope;
}

}  // namespace

ClampedBend::ClampedBend(const Cloth& cloth, const ClampedPlace& place, const Field& x) {
  const Cloth::Line& line = cloth.line(place.direction);
  scale_m2 = 0.5 * line.spacing * line.width[std::min(place.held, place.next)];
  per_square = 4 / std::pow(line.spacing, 4);
  const Vector3d edge = at(x, place.next) - at(x, place.held);
  const double a = edge.dot(place.forward), b = edge.dot(place.normal);
  const double r = std::max(std::hypot(a, b), 1e-150);
  const double lag = a > 0 ? b * b / (r + a) : r - a;  // r - a without cancellation
  const double c = a / r, s = b / r;
  square_m2 = 2 * r * lag;
  curvature_per_m = std::sqrt(per_square * square_m2);
  of_next = 2 * b * (2 - c) * place.normal - 2 * lag * lag / r * place.forward;
  const Matrix3d cross = place.normal * place.forward.transpose();
  const double along = 2 * (lag / r) * (lag / r) * (2 + c);
  curve = (4 - 2 * c * c * c) * place.normal * place.normal.transpose() -
          2 * s * s * s * (cross + cross.transpose()) +
          along * place.forward * place.forward.transpose();
}

void Cloth::clamp(std::vector<ClampedPlace> places) {
  clamped_ = std::move(places);
  for (const ClampedPlace& place : clamped_) lines_[place.direction].triple_width[place.held] = 0;
  prepare_work();
}

void Cloth::add_clamp_forces(const Field& position, Field& force) const {
  for (const ClampedPlace& place : clamped_) {
    const ClampedBend bend(*this, place, position);
    const double secant = secant_of(laws_.bending[place.direction], bend.curvature_per_m);
    const Vector3d pull = 0.5 * bend.scale_m2 * secant * bend.per_square * bend.of_next;
    add_at(force, place.next, -pull);
    add_at(force, place.held, pull);
  }
}

Matrix3d clamped_hessian(const Cloth& cloth, const ClampedPlace& place, const Field& x) {
  const ClampedBend bend(cloth, place, x);
  const ForceCurve& law = cloth.laws().bending[place.direction];
  const double secant = secant_of(law, bend.curvature_per_m);
  const double half = 0.5 * bend.scale_m2 * bend.per_square;
  Matrix3d sum = half * secant * bend.curve;
  if (bend.square_m2 > 0)
    sum += half * (law.tangent(bend.curvature_per_m) - secant) / (2 * bend.square_m2) *
           bend.of_next * bend.of_next.transpose();
  return sum;
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/memory.hpp"

namespace drape::simulate {
namespace {

/// Integral of the limit from 0 to x.
double work_at_limit(const SlipElement& element, double x) {
  double size = std::abs(x);
  if (element.growth < 0) size = std::min(size, element.threshold / -element.growth);
  return std::copysign(element.threshold * size + 0.5 * element.growth * size * size, x);
}

/// The x above `slip` at which the element begins to slip.
double slips_from(const SlipElement& element, double slip) {
  if (element.limit(slip) == 0) return slip;
  const double pull = element.threshold + element.stiffness * slip;
  return pull / (element.stiffness - (pull >= 0 ? element.growth : -element.growth));
}

}  // namespace

double SlipElement::limit(double x) const {
  return std::max(0.0, threshold + growth * std::abs(x));
}

double SlipElement::force(double x, double slip) const {
  const double most = limit(x);
  return std::clamp(stiffness * (x - slip), -most, most);
}

double SlipElement::tangent(double x, double slip) const {
  const double most = limit(x);
  const double trial = stiffness * (x - slip);
  if (std::abs(trial) <= most && most > 0) return stiffness;
  if (most == 0) return 0;
  return (trial > 0) == (x > 0) ? growth : -growth;
}

double SlipElement::potential(double x, double slip) const {
  if (x < slip) return potential(-x, -slip);
  const double from = std::max(slip, slips_from(*this, slip));
  if (x <= from) return 0.5 * stiffness * (x - slip) * (x - slip);
  const double spring = 0.5 * stiffness * (from - slip) * (from - slip);
  return spring + work_at_limit(*this, x) - work_at_limit(*this, from);
}

double SlipElement::settled(double x, double slip) const {
  const double most = limit(x);
  if (std::abs(stiffness * (x - slip)) <= most) return slip;
  return x - force(x, slip) / stiffness;
}

double SlipElement::stored(double x, double slip) const {
  return 0.5 * stiffness * (x - slip) * (x - slip);
}

double FrictionStack::stiffness() const {
  double sum = 0;
  for (const SlipElement& element : elements) sum += element.stiffness;
  return sum;
}

double FrictionStack::force(double x, const double* slip) const {
  double sum = 0;
  for (const SlipElement& element : elements) sum += element.force(x, *slip++);
  return sum;
}

double FrictionStack::tangent(double x, const double* slip) const {
  double sum = 0;
  for (const SlipElement& element : elements) sum += element.tangent(x, *slip++);
  return sum;
}

double FrictionStack::potential(double x, const double* slip) const {
  double sum = 0;
  for (const SlipElement& element : elements) sum += element.potential(x, *slip++);
  return sum;
}

double FrictionStack::settle(double x, double* slip) const {
  double taken = 0;
  for (const SlipElement& element : elements) {
    const double now = element.settled(x, *slip);
    if (now != *slip) taken += element.potential(x, *slip) - element.stored(x, now);
    *slip++ = now;
  }
  return taken;
}

}  // namespace drape::simulate

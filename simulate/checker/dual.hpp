// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "simulate/checker/vectors.hpp"
#include "simulate/fabric/laws.hpp"

/// Dual numbers of the checker, and an element's constitutive laws in terms of them.
namespace drape::simulate::checker {

/// A number with its derivatives by the coordinates of an element.
template <int N>
struct Dual {
  Real v = 0;
  std::array<Real, N> d{};
};

template <int N>
Dual<N> chain(const Dual<N>& x, Real value, Real slope) {
  Dual<N> y;
  y.v = value;
  for (int k = 0; k < N; ++k) y.d[k] = slope * x.d[k];
  return y;
}
template <int N>
Dual<N> operator+(const Dual<N>& a, const Dual<N>& b) {
  Dual<N> y = a;
  y.v += b.v;
  for (int k = 0; k < N; ++k) y.d[k] += b.d[k];
  return y;
}
template <int N>
Dual<N> operator*(Real s, const Dual<N>& a) {
  return chain(a, s * a.v, s);
}
template <int N>
Dual<N> operator-(const Dual<N>& a, const Dual<N>& b) {
  return a + Real(-1) * b;
}
template <int N>
Dual<N> operator*(const Dual<N>& a, const Dual<N>& b) {
  Dual<N> y;
  y.v = a.v * b.v;
  for (int k = 0; k < N; ++k) y.d[k] = a.v * b.d[k] + b.v * a.d[k];
  return y;
}
template <int N>
Dual<N> root(const Dual<N>& a) {
  const Real r = std::sqrt(a.v);
  return chain(a, r, r > 0 ? 1 / (2 * r) : 0);
}

template <int N>
using Vector = std::array<Dual<N>, 3>;

/// Weighted sum of an element's points, with derivatives by their coordinates.
template <int N>
Vector<N> combine(const std::array<std::array<Real, 3>, N / 3>& places,
                  const std::vector<Real>& weights) {
  Vector<N> sum;
  for (std::size_t c = 0; c < places.size(); ++c)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum[axis].v += weights[c] * places[c][axis];
      sum[axis].d[3 * c + axis] = weights[c];
    }
  return sum;
}
template <int N>
Dual<N> dot(const Vector<N>& a, const Vector<N>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Real law_value(const ForceCurve& law, Real x) {
  Real f = Real(law.slope) * x;
  for (const auto& hinge : law.hinges) {
    if (x > hinge.at) f += Real(hinge.change) * (x - Real(hinge.at));
  }
  return f;
}

inline Real law_work(const ForceCurve& law, Real x) {
  Real w = Real(law.slope) * x * x / 2;
  for (const auto& hinge : law.hinges) {
    const Real over = x - Real(hinge.at);
    if (over > 0) w += Real(hinge.change) * over * over / 2;
  }
  return w;
}

template <int N>
Dual<N> work_under(const ForceCurve& law, const Dual<N>& x) {
  return chain(x, law_work(law, x.v), law_value(law, x.v));
}

/// Energy and force of friction elements, each from its own slip. `over_limit` is raised to 1 plus
/// the largest excess of an element over its limit, relative to all limits of the place, if that is
/// more.
template <int N>
Dual<N> slipped(const FrictionStack& stack, const std::vector<double>& memory, int place,
                const Dual<N>& x, Real& over_limit) {
  constexpr Real kNoStrain = 1e-6L;  // rad or 1/m; flat within rounding
  Dual<N> sum;
  const auto count = static_cast<int>(stack.elements.size());
  Real whole = 0;  // sum of the limits, since a single one may be zero at this strain
  for (const SlipElement& element : stack.elements)
    whole += Real(element.threshold) + Real(element.growth) * std::abs(x.v) +
             Real(element.stiffness) * kNoStrain;
  for (int k = 0; k < count; ++k) {
    const SlipElement& element = stack.elements[k];
    const Real over = x.v - Real(memory[place * count + k]);
    const Real stiffness = element.stiffness;
    const Real most = Real(element.threshold) + Real(element.growth) * std::abs(x.v);
    const Real pull = std::abs(stiffness * over);
    over_limit = std::max(over_limit, 1 + (pull - most) / whole);
    sum = sum + chain(x, stiffness * over * over / 2, stiffness * over);
  }
  return sum;
}

}  // namespace drape::simulate::checker

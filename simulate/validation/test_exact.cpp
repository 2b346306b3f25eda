// SPDX-License-Identifier: Apache-2.0
#include "simulate/validation/test_exact.hpp"

#include <Eigen/Dense>
#include <cmath>

namespace drape::simulate::exact {
namespace {

/// One classical Runge-Kutta step of y' = slope(t, y).
template <class State, class Slope>
State step(const State& y, double t, double h, const Slope& slope) {
  const State a = slope(t, y);
  const State b = slope(t + 0.5 * h, State(y + 0.5 * h * a));
  const State c = slope(t + 0.5 * h, State(y + 0.5 * h * b));
  const State d = slope(t + h, State(y + h * c));
  return y + h / 6 * (a + 2 * b + 2 * c + d);
}

/// From the tip inwards, phi = angle from the vertical, t = distance from the tip in units of
/// (B / rho g)^(1/3): phi'' = t sin(phi), phi'(0) = 0. State: phi, phi', x, y. Ends early where
/// phi passes 90 degrees, beyond which other shapes begin.
Eigen::Vector4d from_tip(double log_tip, double reach) {
  const auto slope = [](double t, const Eigen::Vector4d& y) {
    return Eigen::Vector4d(y[1], t * std::sin(y[0]), std::sin(y[0]), std::cos(y[0]));
  };
  constexpr int kSteps = 2000;
  Eigen::Vector4d y(std::exp(log_tip), 0, 0, 0);
  for (int i = 0; i < kSteps && y[0] < 0.5 * kPi; ++i)
    y = step(y, reach * i / kSteps, reach / kSteps, slope);
  return y;
}

/// Right half of the loop from its lowest point: angle, curvature, x, y at the clamp.
Eigen::Vector4d from_bottom(double gamma, double curvature, double load) {
  const auto slope = [&](double s, const Eigen::Vector4d& y) {
    return Eigen::Vector4d(y[1], -gamma * s * std::cos(y[0]) - load * std::sin(y[0]),
                           std::cos(y[0]), std::sin(y[0]));
  };
  constexpr int kSteps = 1000;
  Eigen::Vector4d y(0, curvature, 0, 0);
  for (int i = 0; i < kSteps; ++i) y = step(y, 0.5 * i / kSteps, 0.5 / kSteps, slope);
  return y;
}

/// State of a pressed strip at an arc length from its clamp: angle from straight down, curvature,
/// sideways, drop.
Eigen::Vector4d from_clamp(const PressedStrip& strip, double arc) {
  const auto slope = [&](double s, const Eigen::Vector4d& y) {
    const double thrust = strip.normal - strip.gamma * (1 - s);
    const Eigen::Vector2d along(std::sin(y[0]), std::cos(y[0]));
    const double length = 1 + strip.give * along.dot(Eigen::Vector2d(strip.tangential, -thrust));
    return Eigen::Vector4d(y[1], -length * along.dot(Eigen::Vector2d(thrust, strip.tangential)),
                           length * along[0], length * along[1]);
  };
  constexpr int kSteps = 200;
  Eigen::Vector4d y(0, strip.curvature, 0, 0);
  for (int i = 0; i < kSteps; ++i) y = step(y, arc * i / kSteps, arc / kSteps, slope);
  return y;
}

/// Newton's method on as many equations as unknowns, with central differences; no step is longer
/// than `most`.
template <class Vector, class Miss>
void solve(Vector& unknown, double most, const Miss& miss) {
  constexpr int kIterations = 40;
  constexpr double kDifference = 1e-6;
  for (int i = 0; i < kIterations; ++i) {
    Eigen::Matrix<double, Vector::RowsAtCompileTime, Vector::RowsAtCompileTime> slope;
    for (int k = 0; k < unknown.size(); ++k) {
      const Vector h = kDifference * Vector::Unit(k);
      slope.col(k) = (miss(unknown + h) - miss(unknown - h)) / (2 * kDifference);
    }
    Vector move = slope.inverse() * miss(unknown);
    move *= std::min(1.0, most / move.norm());
    unknown -= move;
    if (move.norm() < 1e-11) return;
  }
}

}  // namespace

Cantilever cantilever(double gamma) {
  const double reach = std::cbrt(gamma);
  // The clamp is reached when phi = 90 degrees; phi there grows with the tip's phi.
  double low = -1.2 * reach * std::sqrt(reach) - 2;
  double high = std::log(0.5 * kPi);
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (from_tip(middle, reach)[0] < 0.5 * kPi ? low : high) = middle;
  }
  const Eigen::Vector4d clamp = from_tip(low, reach);
  return {gamma, clamp[2] / reach, clamp[3] / reach, 0.5 * kPi - std::exp(low)};
}

Eigen::Vector2d Cantilever::at(double arc) const {
  const double reach = std::cbrt(gamma);
  const Eigen::Vector4d y = from_tip(std::log(0.5 * kPi - tip_rad), reach * (1 - arc));
  return {width - y[2] / reach, y[3] / reach - height};
}

Cantilever cantilever_at_chord_angle(double chord_rad) {
  double low = 1e-3;
  double high = 1e3;
  for (int i = 0; i < 60; ++i) {
    const double middle = std::sqrt(low * high);
    const Cantilever shape = cantilever(middle);
    (shape.height / shape.width < std::tan(chord_rad) ? low : high) = middle;
  }
  return cantilever(low);
}

double heart_loop_height(double gamma) {
  // Newton in (curvature at the bottom, horizontal force) from the weightless loop, by steps of
  // the weight; at the clamp the angle is 270 degrees and x is 0.
  Eigen::Vector2d unknown(5.0, -35.0);
  const int stages = 1 + static_cast<int>(gamma / 10);
  for (int stage = 0; stage <= stages; ++stage) {
    const double now = gamma * stage / stages;
    const auto miss = [&](const Eigen::Vector2d& u) {
      const Eigen::Vector4d y = from_bottom(now, u[0], u[1]);
      return Eigen::Vector2d(y[0] - 1.5 * kPi, 10 * y[2]);
    };
    solve(unknown, 3, miss);
  }
  return from_bottom(gamma, unknown[0], unknown[1])[3];
}

double catenary_sag(double chord) {
  // 2 a sinh(chord / 2a) = 1; sag = a (cosh(chord / 2a) - 1).
  double low = 1e-6;
  double high = 1e3;
  for (int i = 0; i < 200; ++i) {
    const double a = std::sqrt(low * high);
    (2 * a * std::sinh(0.5 * chord / a) > 1 ? low : high) = a;
  }
  return low * (std::cosh(0.5 * chord / low) - 1);
}

Elastica elastica(double alpha_rad) {
  const double k = std::sin(0.5 * alpha_rad);
  const double first = std::comp_ellint_1(k);
  const double root = 2 * first / kPi;
  return {root * root, 2 * std::comp_ellint_2(k) / first - 1};
}

double PressedStrip::friction() const {
  return std::abs(tangential) / normal;
}

PressedStrip::Place PressedStrip::at(double arc) const {
  const Eigen::Vector4d y = from_clamp(*this, arc);
  return {y[2], y[3]};
}

PressedStrip pressed_strip(double gamma, double give, double lowered) {
  // From the strip without weight, just buckled and hardly lowered, whose tangential force and
  // curvature at the clamp are both kPerRoot times the root of `slightly`.
  constexpr double kBuckling = 4.493409458;  // tan(k) = k
  constexpr double kPerRoot = 9.1;
  constexpr int kStages = 10;
  const double slightly = std::min(lowered, 0.01);
  const double small = kPerRoot * std::sqrt(slightly);
  Eigen::Vector3d unknown(small, small, kBuckling * kBuckling);
  const auto strip = [give](double weight, const Eigen::Vector3d& u) {
    return PressedStrip{weight, give, u[0], u[1], u[2]};
  };
  for (int stage = 0; stage <= kStages; ++stage) {
    const double part = 1.0 * stage / kStages;
    solve(unknown, 2, [&](const Eigen::Vector3d& u) {
      const Eigen::Vector4d tip = from_clamp(strip(part * gamma, u), 1);
      return Eigen::Vector3d(tip[1], 10 * tip[2],
                             10 * (tip[3] - 1 + slightly + part * (lowered - slightly)));
    });
  }
  return strip(gamma, unknown);
}

double capstan_tension(double slack, double mu, double weight, double radius) {
  // dT/dphi = mu (T + weight R cos phi) - weight R sin phi over the top, phi from -90 degrees
  // (slack side, rising) to +90: the part beyond the top helps the motion.
  using Tension = Eigen::Matrix<double, 1, 1>;
  const auto slope = [&](double phi, const Tension& t) {
    return Tension(mu * (t[0] + weight * radius * std::cos(phi)) - weight * radius * std::sin(phi));
  };
  constexpr int kSteps = 1000;
  Tension t(slack);
  for (int i = 0; i < kSteps; ++i) {
    t = step(t, kPi * i / kSteps - 0.5 * kPi, kPi / kSteps, slope);
  }
  return t[0];
}

}  // namespace drape::simulate::exact

// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/curve.hpp"

#include <limits>

namespace drape::simulate {
namespace {

constexpr int kFitPoints = 100;
constexpr double kExact = 1e-5;  // relative to the largest force; better than any measurement

/// Resamples the curve at equal distances on 0 .. range, so that dense samples weigh no more.
SampledCurve resampled(const SampledCurve& measured, double range) {
  SampledCurve even;
  for (int i = 0; i <= kFitPoints; ++i) {
    const double x = range * i / kFitPoints;
    even.x.push_back(x);
    even.f.push_back(measured.at(x));
  }
  return even;
}

void judge(const SampledCurve& even, FittedCurve& fit) {
  double sum = 0;
  for (std::size_t i = 0; i < even.x.size(); ++i) {
    const double error = std::abs(fit.curve.value(even.x[i]) - even.f[i]);
    sum += error * error;
    fit.largest_error = std::max(fit.largest_error, error);
  }
  fit.rms_error = std::sqrt(sum / static_cast<double>(even.x.size()));
}

/// Squared error of the chord from sample i to sample j.
double chord_error(const SampledCurve& even, int i, int j) {
  const double slope = (even.f[j] - even.f[i]) / (even.x[j] - even.x[i]);
  double sum = 0;
  for (int k = i + 1; k < j; ++k) {
    const double error = even.f[i] + slope * (even.x[k] - even.x[i]) - even.f[k];
    sum += error * error;
  }
  return sum;
}

/// Knots 0 = k0 < .. < k_segments = last that minimise the summed chord errors.
std::vector<int> best_knots(const SampledCurve& even, int segments) {
  const int last = static_cast<int>(even.x.size()) - 1;
  const double never = std::numeric_limits<double>::infinity();
  std::vector<std::vector<double>> cost(segments + 1, std::vector<double>(last + 1, never));
  std::vector<std::vector<int>> from(segments + 1, std::vector<int>(last + 1, 0));
  cost[0][0] = 0;
  for (int j = 1; j <= last; ++j) {
    for (int i = 0; i < j; ++i) {
      const double chord = chord_error(even, i, j);
      for (int s = 1; s <= segments; ++s) {
        if (cost[s - 1][i] + chord < cost[s][j]) {
          cost[s][j] = cost[s - 1][i] + chord;
          from[s][j] = i;
        }
      }
    }
  }
  std::vector<int> knots = {last};
  for (int s = segments; s > 0; --s) knots.push_back(from[s][knots.back()]);
  std::reverse(knots.begin(), knots.end());
  return knots;
}

FittedCurve fit_knots(const SampledCurve& even, const std::vector<int>& knots) {
  FittedCurve fit;
  fit.range = even.x.back();
  double before = 0;
  for (std::size_t k = 0; k + 1 < knots.size(); ++k) {
    const int i = knots[k];
    const int j = knots[k + 1];
    const double slope = (even.f[j] - even.f[i]) / (even.x[j] - even.x[i]);
    if (k == 0) {
      fit.curve.slope = slope;
    } else {
      fit.curve.hinges.push_back({even.x[i], slope - before});
    }
    before = slope;
  }
  judge(even, fit);
  return fit;
}

/// Extends the fit by a straight line to the end of the measurement.
FittedCurve with_tail(FittedCurve fit, const SampledCurve& measured) {
  const double rest = measured.x.back() - fit.range;
  const double slope = (measured.f.back() - fit.curve.value(fit.range)) / rest;
  double before = fit.curve.slope;
  for (const ForceCurve::Hinge& hinge : fit.curve.hinges) before += hinge.change;
  if (std::abs(slope - before) > kExact * before)
    fit.curve.hinges.push_back({fit.range, slope - before});
  return fit;
}

}  // namespace

double SampledCurve::at(double position) const {
  const auto above = std::lower_bound(x.begin(), x.end(), position);
  if (above == x.begin()) return f.front();
  if (above == x.end()) return f.back();
  const auto j = static_cast<std::size_t>(above - x.begin());
  const double t = (position - x[j - 1]) / (x[j] - x[j - 1]);
  return f[j - 1] + t * (f[j] - f[j - 1]);
}

bool ForceCurve::rises() const {
  double now = slope;
  bool rising = now > 0;
  for (const Hinge& hinge : hinges) rising = rising && (now += hinge.change) > 0;
  return rising;
}

double ForceCurve::steepest_up_to(double x) const {
  double now = slope;
  double steepest = slope;
  for (const Hinge& hinge : hinges) {
    if (hinge.at >= x) break;
    now += hinge.change;
    steepest = std::max(steepest, now);
  }
  return steepest;
}

FittedCurve fit_line(const SampledCurve& measured, double range) {
  FittedCurve fit;
  fit.range = std::min(range, measured.x.back());
  const SampledCurve even = resampled(measured, fit.range);
  double xf = 0;
  double xx = 0;
  for (std::size_t i = 0; i < even.x.size(); ++i) {
    xf += even.x[i] * even.f[i];
    xx += even.x[i] * even.x[i];
  }
  fit.curve.slope = xf / xx;
  judge(even, fit);
  return fit;
}

FittedCurve fit_segments(const SampledCurve& measured, int segments) {
  const double range = measured.x.back();
  const SampledCurve even = resampled(measured, range);
  FittedCurve fit;
  for (int pieces = 1; pieces <= segments; ++pieces) {
    fit = fit_knots(even, best_knots(even, pieces));
    if (fit.rms_error <= kExact * std::abs(even.f.back())) break;
  }
  return fit;
}

FittedCurve fit_reached(const SampledCurve& measured, int segments, double reach) {
  FittedCurve line;
  for (std::size_t i = 1; i < measured.x.size() && !(line.curve.slope > 0); ++i)
    line = fit_line(measured, std::max(reach, measured.x[i]));
  if (segments == 1) return line;
  if (line.range >= measured.x.back()) return fit_segments(measured, segments);
  const SampledCurve even = resampled(measured, line.range);
  FittedCurve best = with_tail(line, measured);
  for (int pieces = 1; pieces < segments; ++pieces) {
    if (best.rms_error <= kExact * std::abs(even.f.back())) break;
    const FittedCurve fit = with_tail(fit_knots(even, best_knots(even, pieces)), measured);
    if (fit.curve.rises() && fit.rms_error < best.rms_error) best = fit;
  }
  return best;
}

}  // namespace drape::simulate

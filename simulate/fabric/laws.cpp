// SPDX-License-Identifier: Apache-2.0
#include "simulate/fabric/laws.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "core/files/files.hpp"

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

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Integral of the limit from 0 to x.
double work_at_limit(const SlipElement& element, double x) {
  double size = std::abs(x);
  if (element.growth < 0) size = std::min(size, element.threshold / -element.growth);
  return std::copysign(element.threshold * size + 0.5 * element.growth * size * size, x);
}

/// The x above `slip` at which the element starts to slip.
double slips_from(const SlipElement& element, double slip) {
  if (element.limit(slip) == 0) return slip;
  const double pull = element.threshold + element.stiffness * slip;
  return pull / (element.stiffness - (pull >= 0 ? element.growth : -element.growth));
}

constexpr int kSlips = 6;  // range / 2, / 4, .. / 64
// relative to the largest half width; smaller limits are dropped
constexpr double kActiveLimit = 1e-9;
constexpr double kGradientNoise = 1e-12;  // relative to the largest correlation at the start

/// Half the width, over |x|, of an element's loop between -range and range.
VectorXd half_width_of(const SlipElement& element, const HalfWidth& at, double range) {
  double slip = 0;
  for (const double x : {range, -range}) slip = element.settled(x, slip);
  const double low = slip;  // at -range after a full cycle
  const double high = element.settled(range, low);
  VectorXd h(at.x.size());
  for (std::size_t i = 0; i < at.x.size(); ++i)
    h[static_cast<Eigen::Index>(i)] =
        0.5 * (element.force(at.x[i], low) - element.force(at.x[i], high));
  return h;
}

/// The x >= 0 that minimises |A x - b| (Lawson and Hanson 1974, chapter 23).
VectorXd non_negative_least_squares(const MatrixXd& a, const VectorXd& b) {
  const Eigen::Index n = a.cols();
  VectorXd x = VectorXd::Zero(n);
  std::vector<bool> free(static_cast<std::size_t>(n), false);
  const double noise = kGradientNoise * (a.transpose() * b).cwiseAbs().maxCoeff();
  for (int round = 0; round < 3 * n; ++round) {
    const VectorXd gradient = a.transpose() * (b - a * x);
    Eigen::Index best = -1;
    for (Eigen::Index k = 0; k < n; ++k)
      if (!free[k] && gradient[k] > noise && (best < 0 || gradient[k] > gradient[best])) best = k;
    if (best < 0) break;
    free[best] = true;
    for (;;) {
      std::vector<Eigen::Index> kept;
      for (Eigen::Index k = 0; k < n; ++k)
        if (free[k]) kept.push_back(k);
      const VectorXd solved = a(Eigen::all, kept).colPivHouseholderQr().solve(b);
      double fraction = 1;
      Eigen::Index first = -1;  // first variable to reach zero along the step
      for (Eigen::Index i = 0; i < solved.size(); ++i) {
        if (solved[i] > 0) continue;
        const double reach = x[kept[i]] / (x[kept[i]] - solved[i]);
        if (first >= 0 && reach >= fraction) continue;
        fraction = reach;
        first = kept[i];
      }
      for (Eigen::Index i = 0; i < solved.size(); ++i)
        x[kept[i]] += fraction * (solved[i] - x[kept[i]]);
      if (first < 0) break;
      x[first] = 0;
      free[first] = false;
    }
  }
  return x;
}

void judge_widths(const HalfWidth& loop, const VectorXd& fitted, FittedFriction& fit) {
  double squares = 0;
  for (std::size_t i = 0; i < loop.h.size(); ++i) {
    const double error = std::abs(fitted[static_cast<Eigen::Index>(i)] - loop.h[i]);
    squares += error * error;
    fit.largest_error = std::max(fit.largest_error, error);
  }
  fit.rms_error = std::sqrt(squares / static_cast<double>(loop.h.size()));
}

// Columns: law (0 bending along the warp, 1 along the weft, 2 shear); index (point or triangle
// times number of elements of the law, plus element).
const std::vector<std::string>& memory_columns() {
  static const std::vector<std::string> names = {"law", "index", "slip_per_m_or_rad"};
  return names;
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

FittedFriction friction_of_numbers(const HalfWidth& loop, double slip) {
  const auto n = static_cast<Eigen::Index>(loop.x.size());
  const Eigen::Map<const VectorXd> x(loop.x.data(), n), h(loop.h.data(), n);
  MatrixXd line(n, 2);
  line << VectorXd::Ones(n), x;
  const Eigen::Vector2d found = line.colPivHouseholderQr().solve(h);
  FittedFriction fit;
  fit.elastic_range = loop.x.back();
  SlipElement element{0, found[0], found[1]};
  const double largest = std::max(element.limit(0), element.limit(loop.x.back()));
  element.stiffness = largest / slip;
  if (largest > 0) fit.stack.elements.push_back(element);
  judge_widths(loop, (line * found).cwiseMax(0.0), fit);
  return fit;
}

FittedFriction friction_of_loop(const HalfWidth& loop) {
  const double range = loop.x.back();
  const auto n = static_cast<Eigen::Index>(loop.x.size());
  const Eigen::Map<const VectorXd> h(loop.h.data(), n);
  std::vector<SlipElement> candidates;
  std::vector<double> slips;
  for (int k = 1; k <= kSlips; ++k) {
    const double slip = range / (1 << k);
    candidates.push_back({1 / slip, 1, 0});
    candidates.push_back({1 / slip, 0, 1 / range});
    slips.insert(slips.end(), {slip, slip});
  }
  MatrixXd widths(n, static_cast<Eigen::Index>(candidates.size()));
  for (Eigen::Index k = 0; k < widths.cols(); ++k)
    widths.col(k) = half_width_of(candidates[k], loop, range);
  const VectorXd limits = non_negative_least_squares(widths, h);
  FittedFriction fit;
  double longest = 0;
  for (Eigen::Index k = 0; k < limits.size(); ++k) {
    if (!(limits[k] > kActiveLimit * h.maxCoeff())) continue;
    SlipElement element = candidates[k];
    element.stiffness *= limits[k];
    element.threshold *= limits[k];
    element.growth *= limits[k];
    fit.stack.elements.push_back(element);
    longest = std::max(longest, slips[k]);
  }
  fit.elastic_range = std::max(range / 2, range - 2 * longest);
  judge_widths(loop, widths * limits, fit);
  return fit;
}

std::string memory_csv(const ClothMemory& memory) {
  std::vector<std::vector<double>> columns(3);
  const std::vector<double>* const laws[3] = {&memory.bending[0], &memory.bending[1],
                                              &memory.shear};
  for (int law = 0; law < 3; ++law) {
    for (std::size_t k = 0; k < laws[law]->size(); ++k) {
      columns[0].push_back(law);
      columns[1].push_back(static_cast<double>(k));
      columns[2].push_back((*laws[law])[k]);
    }
  }
  return csv_text(memory_columns(), columns);
}

ClothMemory read_memory(const std::filesystem::path& file) {
  const Csv csv = read_csv(file, memory_columns());
  ClothMemory memory;
  std::vector<double>* const laws[3] = {&memory.bending[0], &memory.bending[1], &memory.shear};
  for (std::size_t i = 0; i < csv.lines.size(); ++i) {
    const double law = csv.columns[0][i];
    if (law != 0 && law != 1 && law != 2) {
      throw bad_input("a law that is not 0, 1 or 2",
                      {.file = file.string(), .line = csv.lines[i], .field = "law"},
                      "simulate again");
    }
    std::vector<double>& slips = *laws[static_cast<int>(law)];
    if (csv.columns[1][i] != static_cast<double>(slips.size())) {
      throw bad_input("the indices of a law are not 0, 1, 2, ..",
                      {.file = file.string(), .line = csv.lines[i], .field = "index"},
                      "simulate again");
    }
    slips.push_back(csv.columns[2][i]);
  }
  return memory;
}

}  // namespace drape::simulate

// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/clock_fit.hpp"

#include <algorithm>
#include <cmath>

namespace drape::capture {
namespace {

constexpr double kNs = 1e-9;
// A round trip below the clocks' resolution would get an unbounded weight.
constexpr double kLeastHalfWidth_s = 1e-7;

struct Point {
  double device_s = 0;  ///< relative to the reference
  double host_s = 0;    ///< middle of the round trip, relative to the reference
  double half_width_s = 0;
};

struct Line {
  double at_zero = 0;
  double slope = 0;
  double residual = 0;
};

/// Fits host - device = at_zero + slope * device, so that the slope is the drift itself.
Line fit_line(const std::vector<Point>& points, bool with_slope) {
  double w = 0, wx = 0, wy = 0;
  for (const Point& p : points) {
    const double weight = 1.0 / (p.half_width_s * p.half_width_s);
    w += weight;
    wx += weight * p.device_s;
    wy += weight * (p.host_s - p.device_s);
  }
  const double mean_x = wx / w;
  const double mean_y = wy / w;
  double sxx = 0, sxy = 0;
  for (const Point& p : points) {
    const double weight = 1.0 / (p.half_width_s * p.half_width_s);
    const double x = p.device_s - mean_x;
    sxx += weight * x * x;
    sxy += weight * x * (p.host_s - p.device_s - mean_y);
  }
  Line line;
  line.slope = with_slope && sxx > 0 ? sxy / sxx : 0;
  line.at_zero = mean_y - line.slope * mean_x;
  double squares = 0;
  for (const Point& p : points) {
    const double weight = 1.0 / (p.half_width_s * p.half_width_s);
    const double r = p.host_s - p.device_s - line.at_zero - line.slope * p.device_s;
    squares += weight * r * r;
  }
  line.residual = std::sqrt(squares / w);
  return line;
}

std::vector<Point> points_of(const std::vector<ClockSample>& samples) {
  const ClockSample& reference = samples.front();
  std::vector<Point> points;
  for (const ClockSample& s : samples) {
    const double before = kNs * static_cast<double>(s.host_before_ns - reference.host_before_ns);
    const double after = kNs * static_cast<double>(s.host_after_ns - reference.host_before_ns);
    points.push_back({kNs * static_cast<double>(s.device_ns - reference.device_ns),
                      0.5 * (before + after), std::max(0.5 * (after - before), kLeastHalfWidth_s)});
  }
  return points;
}

}  // namespace

double ClockFit::host_time_s(std::int64_t device_ns, std::int64_t host_epoch_ns) const {
  const auto since = static_cast<double>(device_ns - reference_device_ns);
  const auto start = static_cast<double>(reference_host_ns - host_epoch_ns);
  return kNs * (start + since + since * drift_ppm * 1e-6);
}

std::optional<ClockFit> fit_clock(const std::vector<ClockSample>& samples,
                                  const ClockFitOptions& options) {
  const auto is_backwards = [](const ClockSample& s) { return s.host_after_ns < s.host_before_ns; };
  if (samples.empty() || std::any_of(samples.begin(), samples.end(), is_backwards)) return {};
  const std::vector<Point> points = points_of(samples);

  ClockFit fit;
  fit.samples = samples.size();
  const auto [first, last] =
      std::minmax_element(points.begin(), points.end(),
                          [](const Point& a, const Point& b) { return a.host_s < b.host_s; });
  fit.span_s = last->host_s - first->host_s;
  fit.drift_estimated = samples.size() >= 2 && fit.span_s >= options.least_span_s;
  const Line line = fit_line(points, fit.drift_estimated);
  fit.drift_ppm = line.slope * 1e6;
  if (std::abs(fit.drift_ppm) > options.largest_ppm) return {};
  // Two samples of a jumped clock may span less than a second; the residual then shows the jump.
  fit.bound_s = std::min_element(points.begin(), points.end(), [](const Point& a, const Point& b) {
                  return a.half_width_s < b.half_width_s;
                })->half_width_s;
  if (!fit.drift_estimated) fit.drift_bound_s = 1e-6 * options.largest_ppm * options.least_span_s;
  fit.residual_s = line.residual;
  fit.reference_device_ns = samples.front().device_ns;
  fit.reference_host_ns =
      samples.front().host_before_ns + static_cast<std::int64_t>(std::llround(line.at_zero / kNs));
  return fit;
}

std::optional<double> clock_jump_s(const ClockSample& before, const ClockSample& after,
                                   double largest_ppm) {
  const std::int64_t least =
      (after.device_ns - after.host_after_ns) - (before.device_ns - before.host_before_ns);
  const std::int64_t most =
      (after.device_ns - after.host_before_ns) - (before.device_ns - before.host_after_ns);
  const double drift =
      1e-6 * largest_ppm * static_cast<double>(after.host_after_ns - before.host_before_ns);
  if (static_cast<double>(least) <= drift && static_cast<double>(most) >= -drift) return {};
  return kNs * 0.5 * (static_cast<double>(least) + static_cast<double>(most));
}

}  // namespace drape::capture

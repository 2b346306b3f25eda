// SPDX-License-Identifier: Apache-2.0
#include "capture/live/phases.hpp"

#include <algorithm>
#include <cmath>

namespace drape::capture {
namespace {

constexpr int kMostTimes = 10;
constexpr std::int64_t kOutOfStep_ns = 1'200'000'000;

}  // namespace

std::vector<double> phases_s(const std::vector<double>& exposed_s, double period_s) {
  std::vector<double> phases;
  phases.reserve(exposed_s.size());
  for (const double t : exposed_s)
    phases.push_back(std::remainder(t - exposed_s.front(), period_s));
  return phases;
}

double least_spread_s(const std::vector<double>& phases_s, double period_s) {
  if (phases_s.empty()) return 0;
  std::vector<double> sorted = phases_s;
  std::sort(sorted.begin(), sorted.end());
  // One period less the largest gap between phases on the circle.
  double largest_gap = period_s - (sorted.back() - sorted.front());
  for (std::size_t i = 1; i < sorted.size(); ++i)
    largest_gap = std::max(largest_gap, sorted[i] - sorted[i - 1]);
  return period_s - largest_gap;
}

std::int64_t begin_again_ns(std::int64_t began_ns, double phase_s, double period_s,
                            std::int64_t not_before_ns) {
  const double first_s = 1e-9 * static_cast<double>(began_ns - not_before_ns) - phase_s;
  return not_before_ns +
         std::llround(1e9 * (first_s + std::ceil(std::max(0.0, -first_s) / period_s) * period_s));
}

std::vector<NewPhase> InStep::look(const std::optional<std::vector<double>>& exposed_s,
                                   std::int64_t now_ns) {
  std::vector<NewPhase> late;
  if (named_ == kMostTimes || 1e-9 * static_cast<double>(now_ns - looked_ns_) < period_s_)
    return late;
  looked_ns_ = now_ns;
  const auto phases = exposed_s ? phases_s(*exposed_s, period_s_) : std::vector<double>{};
  if (least_spread_s(phases, period_s_) <= window_s_) {
    out_of_step_since_ns_ = 0;
    return late;
  }
  if (out_of_step_since_ns_ == 0) out_of_step_since_ns_ = now_ns;
  if (now_ns - out_of_step_since_ns_ < kOutOfStep_ns) return late;
  out_of_step_since_ns_ = 0;
  ++named_;
  for (std::size_t c = 1; c < phases.size(); ++c)
    if (std::abs(phases[c]) > window_s_ / 4) late.push_back({c, phases[c]});
  return late;
}

}  // namespace drape::capture

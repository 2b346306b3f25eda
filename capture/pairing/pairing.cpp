// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/pairing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr double kNs = 1e-9;
// A round trip below the clocks' resolution would get an unbounded weight.
constexpr double kLeastHalfWidth_s = 1e-7;
constexpr double kLeastSpan_s = 1;    ///< shorter spans do not determine the drift
constexpr double kLargest_ppm = 500;  ///< a larger drift is taken for a jump of the clock

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

constexpr std::uint64_t kLast64 = 0x7FFFFFFFFFFFFFFF;
constexpr std::uint64_t kFarthest = 1000;  ///< largest plausible gap, in frames

/// Input indices of one camera's frames that may be part of a set.
using Candidates = std::vector<std::size_t>;

double time_of(const std::vector<FrameMark>& frames, std::size_t i) {
  return *frames[i].time_s;
}

void leave_unpaired(const std::vector<FrameMark>& frames, std::size_t i, Unpaired why,
                    PairingResult& result) {
  result.places[i] = {FrameBin::unpaired, why, std::nullopt};
  ++result.cameras[frames[i].camera].unpaired;
}

/// Bins the frames that cannot be paired and returns the rest per camera.
std::vector<Candidates> sift(const std::vector<FrameMark>& frames, const PairingOptions& options,
                             PairingResult& result) {
  // Fixed order, so that the choice between two frames with one id does not depend on arrival.
  std::vector<std::size_t> order(frames.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    const FrameMark &fa = frames[a], &fb = frames[b];
    if (fa.index != fb.index) return fa.index < fb.index;
    if (fa.complete != fb.complete) return fa.complete;
    return fa.time_s < fb.time_s;
  });
  std::vector<Candidates> candidates(options.cameras);
  std::vector<std::set<std::int64_t>> seen(options.cameras);
  for (const std::size_t i : order) {
    const FrameMark& frame = frames[i];
    FramePlace& place = result.places[i];
    CameraLedger& ledger = result.cameras[frame.camera];
    if (frame.settled) {
      seen[frame.camera].insert(frame.index);
      continue;
    }
    if (!seen[frame.camera].insert(frame.index).second) {
      place.why_unpaired = Unpaired::repeated_id;
      ++ledger.repeated;
    } else if (!frame.complete) {
      place.bin = FrameBin::incomplete;
      ++ledger.incomplete;
    } else if (options.triggers && !frame.trigger) {
      leave_unpaired(frames, i, Unpaired::no_trigger, result);
    } else if (!options.triggers && !frame.time_s) {
      leave_unpaired(frames, i, Unpaired::no_time, result);
    } else if (frame.given_up) {
      leave_unpaired(frames, i, Unpaired::partner_missing, result);
    } else {
      candidates[frame.camera].push_back(i);
    }
  }
  return candidates;
}

std::optional<double> spread_of(const std::vector<FrameMark>& frames,
                                const std::vector<std::size_t>& members) {
  std::vector<double> times;
  for (const std::size_t i : members) {
    if (!frames[i].time_s) return std::nullopt;
    times.push_back(*frames[i].time_s);
  }
  const auto [first, last] = std::ranges::minmax_element(times);
  return *last - *first;
}

void add_set(const std::vector<FrameMark>& frames, std::vector<std::size_t> members,
             std::optional<std::int64_t> trigger, PairingResult& result) {
  for (const std::size_t i : members) {
    result.places[i] = {FrameBin::in_set, Unpaired::no, result.sets.size()};
    ++result.cameras[frames[i].camera].in_set;
  }
  const std::optional<double> spread = spread_of(frames, members);
  result.sets.push_back({std::move(members), trigger, spread});
}

void add_settled_sets(const std::vector<FrameMark>& frames, std::size_t cameras,
                      PairingResult& result) {
  std::map<std::size_t, std::vector<std::size_t>> settled;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!frames[i].settled) continue;
    auto& members = settled.try_emplace(*frames[i].settled, cameras).first->second;
    members[frames[i].camera] = i;
  }
  for (auto& [number, members] : settled) {
    const auto trigger = frames[members.front()].trigger;
    add_set(frames, std::move(members), trigger, result);
  }
}

void pair_by_trigger(const std::vector<FrameMark>& frames,
                     const std::vector<Candidates>& candidates, PairingResult& result) {
  constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::map<std::int64_t, std::vector<std::size_t>> by_trigger;
  for (std::size_t camera = 0; camera < candidates.size(); ++camera) {
    for (const std::size_t i : candidates[camera]) {
      auto& members =
          by_trigger.try_emplace(*frames[i].trigger, candidates.size(), none).first->second;
      if (members[camera] == none) {
        members[camera] = i;
      } else {  // a second frame for one trigger: an unrequested exposure
        leave_unpaired(frames, i, Unpaired::no_trigger, result);
      }
    }
  }
  for (auto& [trigger, members] : by_trigger) {
    if (std::ranges::find(members, none) == members.end()) {
      add_set(frames, members, trigger, result);
      continue;
    }
    for (const std::size_t i : members) {
      if (i != none) leave_unpaired(frames, i, Unpaired::partner_missing, result);
    }
  }
}

/// The next frame of each camera.
struct FirstFrames {
  std::size_t earliest = 0;  ///< index of its camera
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;

  void add(std::size_t camera, double time_s) {
    if (time_s < first_s) earliest = camera;
    first_s = std::min(first_s, time_s);
    last_s = std::max(last_s, time_s);
  }
  [[nodiscard]] double spread_s() const { return last_s - first_s; }
};

/// Walks through all cameras in time. The earliest frame forms a set with the first frames of the
/// others, all of them later, or is in no set.
void pair_by_time(const std::vector<FrameMark>& frames, std::vector<Candidates> candidates,
                  double window_s, PairingResult& result) {
  for (Candidates& list : candidates) {
    std::ranges::stable_sort(list, [&](std::size_t a, std::size_t b) {
      return time_of(frames, a) < time_of(frames, b);
    });
  }
  std::vector<std::size_t> head(candidates.size(), 0);
  const auto all_have_one = [&] {
    for (std::size_t c = 0; c < head.size(); ++c)
      if (head[c] == candidates[c].size()) return false;
    return true;
  };
  const auto time_at = [&](std::size_t c, std::size_t place) {
    return time_of(frames, candidates[c][place]);
  };
  while (all_have_one()) {
    FirstFrames next, better;  // better: replaces the earliest by that camera's next frame
    for (std::size_t c = 0; c < head.size(); ++c) next.add(c, time_at(c, head[c]));
    const bool has_better = head[next.earliest] + 1 < candidates[next.earliest].size();
    for (std::size_t c = 0; c < head.size() && has_better; ++c)
      better.add(c, time_at(c, head[c] + (c == next.earliest ? 1 : 0)));
    if (next.spread_s() <= window_s && !(has_better && better.spread_s() < next.spread_s())) {
      std::vector<std::size_t> members;
      for (std::size_t c = 0; c < head.size(); ++c) members.push_back(candidates[c][head[c]++]);
      add_set(frames, std::move(members), std::nullopt, result);
    } else {
      const std::size_t i = candidates[next.earliest][head[next.earliest]++];
      leave_unpaired(frames, i, Unpaired::partner_missing, result);
    }
  }
  for (std::size_t c = 0; c < head.size(); ++c) {
    for (; head[c] < candidates[c].size(); ++head[c])
      leave_unpaired(frames, candidates[c][head[c]], Unpaired::partner_missing, result);
  }
}

void count_expected(const std::vector<FrameMark>& frames, const PairingOptions& options,
                    PairingResult& result) {
  std::vector<std::optional<std::pair<std::int64_t, std::int64_t>>> span(options.cameras);
  for (const FrameMark& frame : frames) {
    auto& [first, last] = span[frame.camera] ? *span[frame.camera]
                                             : span[frame.camera].emplace(frame.index, frame.index);
    first = std::min(first, frame.index);
    last = std::max(last, frame.index);
  }
  for (std::size_t c = 0; c < options.cameras; ++c) {
    CameraLedger& ledger = result.cameras[c];
    const std::int64_t seen = span[c] ? span[c]->second - span[c]->first + 1 : 0;
    const std::int64_t asked = options.triggers.value_or(options.expected_frames.value_or(seen));
    const std::int64_t arrived = ledger.in_set + ledger.unpaired + ledger.incomplete;
    // More frames than triggers: the camera also exposed untriggered; all its frames are counted.
    ledger.expected = std::max(asked, arrived);
    ledger.never_arrived = ledger.expected - arrived;
  }
}

}  // namespace

double ClockFit::host_time_s(std::int64_t device_ns, std::int64_t host_epoch_ns) const {
  const auto since = static_cast<double>(device_ns - reference_device_ns);
  const auto start = static_cast<double>(reference_host_ns - host_epoch_ns);
  return kNs * (start + since + since * drift_ppm * 1e-6);
}

std::optional<ClockFit> fit_clock(const std::vector<ClockSample>& samples) {
  const auto is_backwards = [](const ClockSample& s) { return s.host_after_ns < s.host_before_ns; };
  if (samples.empty() || std::ranges::any_of(samples, is_backwards)) return {};
  const std::vector<Point> points = points_of(samples);

  ClockFit fit;
  fit.samples = samples.size();
  const auto [first, last] = std::ranges::minmax_element(points, {}, &Point::host_s);
  fit.span_s = last->host_s - first->host_s;
  fit.drift_estimated = samples.size() >= 2 && fit.span_s >= kLeastSpan_s;
  const Line line = fit_line(points, fit.drift_estimated);
  fit.drift_ppm = line.slope * 1e6;
  if (std::abs(fit.drift_ppm) > kLargest_ppm) return {};
  // Two samples of a jumped clock may span less than a second; the residual then shows the jump.
  fit.bound_s = std::ranges::min_element(points, {}, &Point::half_width_s)->half_width_s;
  if (!fit.drift_estimated) fit.drift_bound_s = 1e-6 * kLargest_ppm * kLeastSpan_s;
  fit.residual_s = line.residual;
  fit.reference_device_ns = samples.front().device_ns;
  fit.reference_host_ns =
      samples.front().host_before_ns + static_cast<std::int64_t>(std::llround(line.at_zero / kNs));
  return fit;
}

std::optional<double> clock_jump_s(const ClockSample& before, const ClockSample& after) {
  const std::int64_t least =
      (after.device_ns - after.host_after_ns) - (before.device_ns - before.host_before_ns);
  const std::int64_t most =
      (after.device_ns - after.host_before_ns) - (before.device_ns - before.host_after_ns);
  const double drift =
      1e-6 * kLargest_ppm * static_cast<double>(after.host_after_ns - before.host_before_ns);
  if (static_cast<double>(least) <= drift && static_cast<double>(most) >= -drift) return {};
  return kNs * 0.5 * (static_cast<double>(least) + static_cast<double>(most));
}

FrameIdUnwrapper::FrameIdUnwrapper(FrameIdRange range) : range_(range) {
  if (range.last <= range.first)
    throw usage_error("the range of frame ids is empty", "give first and last, first below last");
}

std::optional<std::int64_t> FrameIdUnwrapper::unwrap(std::uint64_t id) {
  if (id < range_.first) return std::nullopt;
  const bool beyond = id > range_.last;  // extended ids continue where 16 bits would wrap
  const bool wraps = !beyond && range_.last < kLast64;
  if (!wraps && newest_id_ && id > *newest_id_ && id - *newest_id_ > kFarthest) return std::nullopt;
  if (beyond) range_.last = kLast64;
  if (!newest_id_) {
    newest_id_ = id;
    return 0;
  }
  std::int64_t step = static_cast<std::int64_t>(id) - static_cast<std::int64_t>(*newest_id_);
  if (wraps) {
    const auto period = static_cast<std::int64_t>(range_.last - range_.first + 1);
    if (step > period / 2) step -= period;
    if (step < -(period / 2)) step += period;
  }
  const std::int64_t unwrapped = newest_ + step;
  if (step > 0) {
    newest_ = unwrapped;
    newest_id_ = id;
  }
  return unwrapped;
}

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
  std::ranges::sort(sorted);
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

PairingResult pair_frames(const std::vector<FrameMark>& frames, const PairingOptions& options) {
  if (options.cameras == 0)
    throw usage_error("no camera to pair frames of", "name at least one camera");
  if (!options.triggers && !(options.window_s > 0))
    throw usage_error("the pairing window is not positive", "give half the frame period or less");
  for (const FrameMark& frame : frames) {
    if (frame.camera >= options.cameras)
      throw internal_error(
          fmt::format("a frame of camera {} among {}", frame.camera, options.cameras));
  }
  PairingResult result;
  result.places.resize(frames.size());
  result.cameras.resize(options.cameras);
  std::vector<Candidates> candidates = sift(frames, options, result);
  add_settled_sets(frames, options.cameras, result);
  if (options.triggers) {
    pair_by_trigger(frames, candidates, result);
  } else {
    pair_by_time(frames, std::move(candidates), options.window_s, result);
  }
  count_expected(frames, options, result);
  return result;
}

std::vector<std::size_t> frames_of_sets(const std::vector<FrameMark>& frames,
                                        const PairingResult& pairing, std::size_t most) {
  std::vector<std::size_t> kept(frames.size());
  std::iota(kept.begin(), kept.end(), std::size_t{0});
  if (pairing.sets.empty() || most == 0) return kept;
  const PairedFrames& first = pairing.sets.front();
  const PairedFrames& last = pairing.sets[std::min(pairing.sets.size(), most) - 1];
  std::erase_if(kept, [&](std::size_t i) {
    const std::size_t c = frames[i].camera;
    return frames[i].index < frames[first.frames[c]].index ||
           frames[i].index > frames[last.frames[c]].index;
  });
  return kept;
}

std::optional<std::int64_t> trigger_of(double time_s, const std::vector<double>& trigger_time_s,
                                       double early_s, double latest_s) {
  const auto after = std::ranges::upper_bound(trigger_time_s, time_s + early_s);
  if (after == trigger_time_s.begin()) return std::nullopt;
  const auto trigger = std::prev(after);
  if (time_s - *trigger > latest_s) return std::nullopt;
  return std::distance(trigger_time_s.begin(), trigger);
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#include "capture/pairing/pairing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include "core/error.hpp"

namespace drape::capture {
namespace {

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
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
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
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
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
    if (std::find(members.begin(), members.end(), none) == members.end()) {
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

/// Walks through all cameras in time. The earliest frame is either part of a set with the first
/// frames of the others, which all lie later, or of none.
void pair_by_time(const std::vector<FrameMark>& frames, std::vector<Candidates> candidates,
                  double window_s, PairingResult& result) {
  for (Candidates& list : candidates) {
    std::stable_sort(list.begin(), list.end(), [&](std::size_t a, std::size_t b) {
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

void PairingOptions::check() const {
  if (cameras == 0) throw usage_error("no camera to pair frames of", "name at least one camera");
  if (!triggers && !(window_s > 0))
    throw usage_error("the pairing window is not positive", "give half the frame period or less");
}

PairingResult pair_frames(const std::vector<FrameMark>& frames, const PairingOptions& options) {
  options.check();
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
  if (pairing.sets.empty() || most == 0) return every_frame(frames);
  const PairedFrames& first = pairing.sets.front();
  const PairedFrames& last = pairing.sets[std::min(pairing.sets.size(), most) - 1];
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::size_t c = frames[i].camera;
    if (frames[i].index >= frames[first.frames[c]].index &&
        frames[i].index <= frames[last.frames[c]].index)
      kept.push_back(i);
  }
  return kept;
}

std::vector<std::size_t> every_frame(const std::vector<FrameMark>& frames) {
  std::vector<std::size_t> all(frames.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::optional<std::int64_t> trigger_of(double time_s, const std::vector<double>& trigger_time_s,
                                       double early_s, double latest_s) {
  const auto after =
      std::upper_bound(trigger_time_s.begin(), trigger_time_s.end(), time_s + early_s);
  if (after == trigger_time_s.begin()) return std::nullopt;
  const auto trigger = std::prev(after);
  if (time_s - *trigger > latest_s) return std::nullopt;
  return std::distance(trigger_time_s.begin(), trigger);
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
// The sync methods, and what comes out of them.
#include "capture/live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "capture/live/clocks.hpp"
#include "capture/live/develop.hpp"
#include "capture/live/opening.hpp"

namespace drape::capture {
namespace {

constexpr double kScheduleAhead_s = 0.03;  ///< until every camera surely holds the command
constexpr double kTriggerEarly_s = 2e-3;   ///< clock error allowed before a trigger
constexpr double kStreamEnds_s = 0.3;      ///< once asked to

/// Then its frames are assigned by counting triggers.
bool never_had_clock(const Running& r) {
  return !r.host->on_host_clock() &&
         std::all_of(r.clocks.begin(), r.clocks.end(),
                     [](const auto& readings) { return readings.empty(); });
}

double tick_hz(const CameraHost& host) {
  for (const SettingReadBack& s : host.settings())
    if (s.name == "clock_tick_hz" && s.value != "not given") return std::stod(s.value);
  return 1e9;
}

}  // namespace

bool Session::patience_ended() const {
  if (interrupted()) return true;
  const bool lost =
      std::any_of(running_.begin(), running_.end(), [](const Running& r) { return r.given_up; });
  return lost || seconds(now_ns() - last_progress_ns_) > options_.patience_s;
}

void Session::tell_progress(std::int64_t done) {
  if (options_.progress)
    options_.progress(std::min(1.0, static_cast<double>(done) / options_.frames),
                      fmt::format("{} sets", done));
}

void Session::keep_in_step() {
  for (const LiveCamera& camera : file_.cameras)
    if (camera.address.backend == Backend::replay) return;
  for (const NewPhase& late : steps_.look(newest_exposures_s(running_, epoch_ns_), now_ns()))
    begin_again(late.camera, late.phase_s);
}

void Session::begin_again(std::size_t c, double phase_s) {
  Running& r = running_[c];
  add_fault(report_.faults,
            {name(c),
             fmt::format("it exposes {:.1f} ms beside `{}`: its stream begins again in step",
                         1e3 * phase_s, name(0)),
             "use cameras with a trigger where that is too far apart"});
  r.host->stop();
  r.started = false;
  r.begin_ns = begin_again_ns(r.began_ns, phase_s, 1 / file_.frame_rate_hz,
                              now_ns() + std::llround(1e9 * kStreamEnds_s));
}

void Session::run_free() {
  std::int64_t look_at = options_.on_set ? 1 : options_.frames;
  while (!patience_ended() && seconds(now_ns() - streaming_since_ns_) < longest_s()) {
    wait(std::min(0.02, until_next_s(running_, now_ns())));
    take_in();
    keep_in_step();
    if (options_.demand) {
      const auto demand = options_.demand();
      if (demand == LiveOptions::Demand::end) return;
      if (demand == LiveOptions::Demand::wait) {
        set_light();
        forget_unsettled();
        continue;
      }
    }
    const std::int64_t have = least_complete(running_);
    tell_progress(have);
    const bool quiet = seconds(now_ns() - last_progress_ns_) > 2 / file_.frame_rate_hz;
    if (have < look_at && !quiet) continue;
    // One more frame of each, or silence: the last set's best partner has surely come.
    const PairingResult pairing = pair(marks());
    const std::size_t sets = pairing.sets.size();
    give_out(pairing, quiet);
    const auto wanted = static_cast<std::size_t>(options_.frames);
    if (sets > wanted || (quiet && sets == wanted)) return;
    look_at = options_.demand ? 0 : have + 1;
  }
}

void Session::give_out(const PairingResult& pairing, bool all) {
  if (!options_.on_set) return;
  for (const PairedFrames& set : pairing.sets) {
    if (given_out_ == static_cast<std::size_t>(options_.frames)) return;
    const auto sure = [&](std::size_t i) {
      const Arrival& a = arrivals_[i];
      const bool confirmed = by_trigger() || ended_ || is_confirmed(running_[a.camera], a);
      return confirmed && (all || a.index < running_[a.camera].newest);
    };
    if (arrivals_[set.frames.front()].settled) continue;
    if (!std::all_of(set.frames.begin(), set.frames.end(), sure)) return;
    LiveSet live = set_of(set);
    for (const std::size_t i : set.frames) arrivals_[i].settled = given_out_;
    ++given_out_;
    options_.on_set(std::move(live), report_up_to_now(pairing));
  }
}

LiveSet Session::set_of(const PairedFrames& set) {
  LiveSet live{
      report_.paired_by == PairedBy::arrival ? std::nullopt : set.spread_s, {}, set.trigger, {}};
  const std::vector<FrameMark> all = marks();
  std::int64_t last_ns = 0;
  for (const std::size_t i : set.frames) {
    Arrival& a = arrivals_[i];
    LiveFrame frame = develop(std::move(a.frame), running_[a.camera].host->pixel_format());
    frame.mark = all[i];
    if (report_.paired_by == PairedBy::arrival) frame.mark.time_s.reset();
    last_ns = std::max(last_ns, a.arrived_ns);
    live.frames.push_back(std::move(frame));
  }
  // Exposed after the trigger was sent, and before the last frame was there.
  if (!live.spread_s && set.trigger)
    live.spread_bound_s = seconds(last_ns - trigger_ns_[static_cast<std::size_t>(*set.trigger)]);
  return live;
}

double Session::longest_s() const {
  return 2 * options_.patience_s + 5 * (options_.frames + 2) / file_.frame_rate_hz;
}

bool Session::await_demand() {
  if (!options_.demand) return true;
  std::int64_t next_ns = 0;
  while (!interrupted()) {
    const auto demand = options_.demand();
    if (demand == LiveOptions::Demand::end) return false;
    if (demand == LiveOptions::Demand::take) return true;
    set_light();
    if (options_.on_frame && by_trigger() && now_ns() >= next_ns) {
      next_ns = now_ns() + std::llround(1e9 / file_.frame_rate_hz);
      trigger_for_screen();
    }
    wait(0.02);
    take_in();
    forget_unsettled();
  }
  return false;
}

void Session::set_light() {
  if (!options_.light) return;
  while (const auto light = options_.light())
    running_[light->camera].host->set_light(light->wanted);
}

/// It keeps its number, so that a late frame of it never passes for one of the next.
void Session::trigger_for_screen() {
  fire();
  --report_.triggers;
  ++report_.triggers_before;
  await_answers(kAnswer_s);
  settle_counts();
}

void Session::forget_unsettled() {
  std::erase_if(arrivals_, [](const Arrival& a) { return !a.settled; });
  last_progress_ns_ = streaming_since_ns_ = now_ns();
}

void Session::run_triggered() {
  const auto pace_ns = std::llround(1e9 / file_.frame_rate_hz);
  std::int64_t next_ns = now_ns();
  for (int k = 0; k < options_.frames && await_demand(); ++k) {
    while (now_ns() < next_ns && !patience_ended()) {
      wait(seconds(next_ns - now_ns()));
      take_in();
    }
    if (patience_ended()) return;
    next_ns = now_ns() + pace_ns;
    fire();
    await_answers(kLateAnswer_s);
    settle_counts();
    await_readings();
    const PairingResult pairing = pair(marks());
    give_out(pairing, true);
    tell_progress(k + 1);
  }
}

void Session::fire() {
  ++report_.triggers;
  std::int64_t at = now_ns();
  for (Running& r : running_)
    if (streaming_since_ns_ > 0 && r.unanswered++ == 0) r.asked_ns = at;
  if (report_.method == SyncMethod::software_trigger) {
    for (Running& r : running_) r.host->trigger();
  } else if (report_.method == SyncMethod::action) {
    for (const Running& r : running_) act(r, std::nullopt);
  } else if (report_.method == SyncMethod::scheduled_action) {
    at += std::llround(1e9 * kScheduleAhead_s);
    for (const Running& r : running_) act(r, at);
  }
  trigger_ns_.push_back(at);
}

void Session::act(const Running& r, std::optional<std::int64_t> host_ns) {
  std::optional<std::int64_t> device_ns;
  if (host_ns) {
    const auto clock = newest_clock(r.clocks);
    if (!clock) return;
    const auto since = static_cast<double>(*host_ns - clock->reference_host_ns);
    device_ns = clock->reference_device_ns + std::llround(since / (1 + 1e-6 * clock->drift_ppm));
  }
  // Cameras count ticks of their own; under PTP they count ns and say so.
  if (device_ns)
    device_ns = std::llroundl(static_cast<long double>(*device_ns) * tick_hz(*r.host) / 1e9L);
  if (!actions_) actions_ = std::make_unique<ActionSender>(r.host->identity().host_address);
  if (!actions_->send(r.host->identity().address, device_ns))
    add_fault(report_.faults,
              {"", "an action command could not be sent", "check the network card"});
}

void Session::settle_counts() {
  for (Running& r : running_) {
    const std::int64_t last = last_trigger();
    if (!never_had_clock(r) || !by_trigger() || r.host->fault()) continue;
    if (r.counted && r.counted->trigger == last) {
      r.silent_triggers = 0;
      continue;
    }
    if (++r.silent_triggers < 2) continue;
    // So long without a late frame: the next one answers the next trigger.
    const std::int64_t before = r.newest, until = now_ns() + std::llround(1e9 * kLateAnswer_s);
    while (now_ns() < until && r.newest == before) {
      wait(0.02);
      take_in();
    }
    if (r.newest != before) continue;
    r.counted = Running::Counted{r.newest, last};
    r.silent_triggers = 0;
  }
}

void Session::await_answers(double within_s, double quiet_s) {
  std::vector<std::int64_t> before;
  for (const Running& r : running_) before.push_back(r.newest);
  double exposure_s = 0;
  for (const Running& r : running_)
    exposure_s = std::max(exposure_s, 1e-6 * r.host->wanted().exposure_us.value_or(0));
  // A line is pulsed from outside whenever it likes.
  const double allowed =
      report_.method == SyncMethod::line_trigger ? options_.patience_s : exposure_s + within_s;
  const std::int64_t until = now_ns() + std::llround(1e9 * allowed);
  const auto answered = [&] {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      const Running& r = running_[c];
      // A session goes on with the others; a counted trigger waits for one that is opened again.
      const bool away = r.host->fault() || (options_.demand && !r.started);
      if (r.newest == before[c] && !away) return false;
    }
    return true;
  };
  std::int64_t quiet_from = now_ns();
  const auto is_quiet = [&] {
    for (const Running& r : running_) quiet_from = std::max(quiet_from, r.last_frame_ns);
    return now_ns() - quiet_from >= std::llround(1e9 * quiet_s);
  };
  while (!interrupted() && now_ns() < until + std::llround(1e9 * quiet_s) &&
         ((now_ns() < until && !answered()) || !is_quiet())) {
    wait(0.02);
    take_in();
  }
}

std::optional<double> Session::time_of(const Arrival& a,
                                       const std::vector<std::optional<ClockFit>>& clocks) const {
  if (report_.paired_by == PairedBy::arrival) return seconds(a.arrived_ns - epoch_ns_);
  if (!a.frame.device_ns) return std::nullopt;
  if (running_[a.camera].host->on_host_clock()) return seconds(*a.frame.device_ns - epoch_ns_);
  if (!a.clock || !clocks[*a.clock]) return std::nullopt;
  return clocks[*a.clock]->host_time_s(*a.frame.device_ns, epoch_ns_);
}

bool Session::by_trigger() const {
  return report_.method != SyncMethod::free_run && report_.method != SyncMethod::line_trigger;
}

std::vector<FrameMark> Session::marks() const {
  std::vector<std::vector<std::optional<ClockFit>>> clocks;
  for (const Running& r : running_) clocks.push_back(fit_clocks(r.clocks));
  std::vector<double> triggers;
  for (const std::int64_t t : trigger_ns_) triggers.push_back(seconds(t - epoch_ns_));
  std::vector<FrameMark> result;
  for (const Arrival& a : arrivals_) {
    FrameMark mark{a.camera,     a.index,          time_of(a, clocks[a.camera]),
                   std::nullopt, a.frame.complete, a.settled,
                   a.given_up};
    if (by_trigger() && mark.time_s)
      mark.trigger = trigger_of(*mark.time_s, triggers, kTriggerEarly_s, kLateAnswer_s);
    if (by_trigger() && never_had_clock(running_[a.camera])) mark.trigger = a.counted_trigger;
    result.push_back(mark);
  }
  return result;
}

PairingResult Session::pair(const std::vector<FrameMark>& frames) const {
  PairingOptions options;
  options.cameras = running_.size();
  options.window_s = window_s();
  if (by_trigger()) options.triggers = report_.triggers;
  if (options_.demand && !by_trigger()) options.expected_frames = 0;  // as many as were looked at
  return pair_frames(frames, options);
}

double Session::window_s() const {
  return std::min(file_.largest_spread_s, 0.4 / file_.frame_rate_hz);
}

}  // namespace drape::capture

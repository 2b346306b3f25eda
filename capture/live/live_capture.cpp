// SPDX-License-Identifier: Apache-2.0
#include "capture/live/live_capture.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <utility>

#include "capture/live/action_command.hpp"
#include "capture/live/clocks.hpp"
#include "capture/live/phases.hpp"
#include "capture/live/running.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kRetryEvery_s = 0.3;
constexpr double kRoom_s = 1.5;  ///< of frames that wait in shared memory while this process does
constexpr double kStopping_s = 2;
constexpr double kScheduleAhead_s = 0.03;     ///< until every camera surely holds the command
constexpr double kTriggerEarly_s = 2e-3;      ///< clock error allowed before a trigger
constexpr double kAnswer_s = 0.5;             ///< of a trigger, above the exposure
constexpr std::int64_t kPartnersWithin = 20;  ///< frames: a later partner would be off by seconds
constexpr double kLargestDelay_s = 5;         ///< between exposure and arrival of a frame
constexpr double kStreamEnds_s = 0.3;         ///< once told to

std::int64_t now_ns() {
  return Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

double seconds(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

class Session {
 public:
  Session(const CamerasFile& cameras, const LiveOptions& options)
      : file_(cameras), options_(options), epoch_ns_(now_ns()), last_progress_ns_(epoch_ns_) {
    for (const LiveCamera& camera : file_.cameras) {
      HostOptions host;
      host.program = options_.host_program;
      host.memory_limit_mb = options_.memory_limit_mb;
      host.opening_s = options_.opening_s;
      host.slots = std::clamp<std::size_t>(std::lround(kRoom_s * file_.frame_rate_hz), 8, 64);
      host.slot_bytes = static_cast<std::size_t>(*camera.settings.width_px) *
                        static_cast<std::size_t>(*camera.settings.height_px);
      auto& running = running_.emplace_back();
      running.host = std::make_unique<CameraHost>(camera.address, camera.settings, host);
    }
  }

  LiveResult run() {
    open_with_fall_backs();
    for (Running& r : running_) start(r);
    await_streams();
    streaming_since_ns_ = last_progress_ns_ = now_ns();
    report_.method == SyncMethod::free_run ? run_free() : run_triggered();
    stop_streams();
    return finish();
  }

 private:
  // ---- opening ------------------------------------------------------------------------------
  void open_with_fall_backs() {
    std::vector<SyncMethod> methods = {file_.method};
    methods.insert(methods.end(), file_.fall_backs.begin(), file_.fall_backs.end());
    for (std::size_t i = 0;; ++i) {
      report_.method = methods[i];
      const auto refused = open_all(methods[i]);
      if (!refused) return;
      if (i + 1 == methods.size())
        throw Error(ErrorKind::device, refused->what, {.camera = refused->camera},
                    refused->what_to_do);
      report_.why_fallen_back +=
          fmt::format("{}{}: camera `{}`: {}", report_.why_fallen_back.empty() ? "" : "; ",
                      to_string(methods[i]), refused->camera, refused->what);
    }
  }

  std::optional<LiveFault> open_all(SyncMethod method) {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      CameraSettings settings = file_.cameras[c].settings;
      settings.trigger = trigger_of(method);
      running_[c].host->set_settings(settings);
      running_[c].host->launch();
    }
    const std::int64_t until = now_ns() + std::llround(1e9 * options_.opening_s);
    for (;;) {
      wait(0.02);
      bool all = true;
      for (std::size_t c = 0; c < running_.size(); ++c) {
        CameraHost& host = *running_[c].host;
        host.pump();
        all = all && host.ready();
        if (host.fault()) return LiveFault{name(c), *host.fault(), host.what_to_do()};
        if (!host.ready() && now_ns() > until)
          return LiveFault{name(c), "it does not open", "check cable and power of the camera"};
      }
      if (all) return method == SyncMethod::scheduled_action ? without_clock() : std::nullopt;
    }
  }

  std::optional<LiveFault> without_clock() {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      if (!fit_clock(running_[c].host->clock_samples(), {}))
        return LiveFault{name(c), "its clock cannot be read", "use another sync method"};
    }
    return std::nullopt;
  }

  void start(Running& r) {
    r.ids = FrameIdUnwrapper(r.host->frame_ids());
    r.base = r.newest + 1;
    r.fresh = true;
    r.started = true;
    r.clock_taken = 0;
    r.clocks.emplace_back();
    r.last_frame_ns = r.began_ns = now_ns();
    r.host->start();
  }

  /// A trigger before the last camera streams would be half an instant.
  void await_streams() {
    const std::int64_t until = now_ns() + std::llround(1e9 * options_.opening_s);
    const auto streams = [](const Running& r) { return r.host->started() || r.host->fault(); };
    while (now_ns() < until && !std::all_of(running_.begin(), running_.end(), streams)) {
      wait(0.02);
      take_in();
    }
  }

  /// Waits for the final packet counts; frames that still come are outside the capture.
  void stop_streams() {
    for (Running& r : running_) r.host->stop();
    const std::int64_t until = now_ns() + std::llround(1e9 * kStopping_s);
    const auto stopped = [](const Running& r) { return !r.host->started() || r.host->fault(); };
    while (now_ns() < until && !std::all_of(running_.begin(), running_.end(), stopped)) {
      wait(0.02);
      for (Running& r : running_) r.host->pump();
    }
    for (std::size_t c = 0; c < running_.size(); ++c) take_readings(c);
  }

  // ---- taking in what the hosts say ---------------------------------------------------------
  void wait(double timeout_s) {
    std::vector<pollfd> descriptors;
    for (const Running& r : running_) descriptors.push_back({r.host->descriptor(), POLLIN, 0});
    ::poll(descriptors.data(), descriptors.size(), static_cast<int>(std::ceil(1e3 * timeout_s)));
  }

  void take_in() {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      Running& r = running_[c];
      r.host->pump();
      take_readings(c);
      while (!r.host->frames().empty()) {
        take_frame(c, std::move(r.host->frames().front()));
        r.host->frames().pop_front();
      }
      look_after(c);
    }
  }

  void take_readings(std::size_t c) {
    Running& r = running_[c];
    const auto& samples = r.host->clock_samples();
    for (; r.started && r.clock_taken < samples.size(); ++r.clock_taken)
      take_reading(c, samples[r.clock_taken]);
  }

  void take_reading(std::size_t c, const ClockSample& sample) {
    Running& r = running_[c];
    std::vector<ClockSample>& clock = r.clocks.back();
    const auto jump = clock.empty() ? std::nullopt : clock_jump_s(clock.back(), sample);
    if (!jump) return clock.push_back(sample);
    report_.faults.push_back(
        {name(c),
         fmt::format("its clock jumped by {:.3f} s; frames around that have no time", *jump),
         "let nothing set the camera's clock during a capture (PTP, other programs)"});
    const std::int64_t last_good_ns = clock.back().host_before_ns;
    for (Arrival& a : arrivals_)
      if (a.camera == c && a.arrived_ns >= last_good_ns) a.clock.reset();
    r.sure_from_ns = now_ns() + std::llround(1e9 * kAnswer_s);
    r.clocks.push_back({sample});
  }

  /// A driver that says its times are the host's, and they are not.
  void check_stamp(std::size_t c, HostFrame& frame) {
    if (file_.cameras[c].address.backend != Backend::v4l2 || !frame.device_ns) return;
    const double off_s = seconds(*frame.device_ns - now_ns());
    if (std::abs(off_s) < kLargestDelay_s) return;
    frame.device_ns.reset();
    if (std::exchange(running_[c].stamps_are_off, true)) return;
    report_.faults.push_back(
        {name(c), fmt::format("its time stamps are {:.0f} s off the host's clock", off_s),
         "unplug and plug the camera; until then its frames cannot be paired by time"});
  }

  void take_frame(std::size_t c, HostFrame frame) {
    Running& r = running_[c];
    const auto unwrapped = r.ids.unwrap(frame.id);
    if (!unwrapped) return;
    const bool free = report_.method == SyncMethod::free_run;
    if (r.fresh) rebase(r, frame, free ? std::optional(file_.frame_rate_hz) : std::nullopt);
    r.fresh = false;
    const std::int64_t index = r.base + *unwrapped;
    r.newest = std::max(r.newest, index);
    check_stamp(c, frame);
    if (frame.device_ns) r.newest_device_ns = frame.device_ns;
    r.last_frame_ns = now_ns();
    last_progress_ns_ = r.last_frame_ns;
    if (r.failed_ns != 0) {
      r.longest_gap_s = std::max(r.longest_gap_s, seconds(now_ns() - r.failed_ns));
      r.failed_ns = 0;
    }
    if (frame.complete) {
      ++r.complete;
    } else {
      report_.faults.push_back({name(c), "a frame is incomplete: " + frame.fault,
                                "raise packet_delay_ns or the socket buffer; see `drape doctor`"});
    }
    if (!options_.keep_pixels) frame.pixels = {};
    std::optional<std::size_t> clock;
    if (r.last_frame_ns >= r.sure_from_ns && !r.clocks.empty()) clock = r.clocks.size() - 1;
    arrivals_.push_back({c, index, clock, r.last_frame_ns, std::move(frame)});
  }

  /// Notices a camera that is lost and brings it back, while the others go on.
  void look_after(std::size_t c) {
    Running& r = running_[c];
    const std::int64_t now = now_ns();
    const double quiet_s = 2 / file_.frame_rate_hz + 0.5;
    const bool streaming = r.started && r.host->ready() && !r.host->fault();
    const bool live = file_.cameras[c].address.backend != Backend::replay;
    const bool quiet = report_.method == SyncMethod::free_run && streaming && live &&
                       seconds(now - r.last_frame_ns) > quiet_s;
    if (r.host->fault() || quiet) {
      if (r.started) {
        report_.faults.push_back({name(c), r.host->fault().value_or("it stopped sending frames"),
                                  "check cable and power of the camera; it is opened again"});
        if (r.failed_ns == 0) r.failed_ns = now;
        r.longest_unnoticed_s = std::max(r.longest_unnoticed_s, seconds(now - r.last_frame_ns));
        r.started = false;
        r.retry_ns = now;
      }
      if (now >= r.retry_ns) {
        r.retry_ns = now + std::llround(1e9 * kRetryEvery_s);
        r.host->launch();
      }
    } else if (!r.started && r.host->ready() && now >= r.begin_ns) {
      // One that still ends its stream begins a period later, in the same phase.
      r.host->started() ? void(r.begin_ns += std::llround(1e9 / file_.frame_rate_hz)) : start(r);
    }
  }

  // ---- the sync methods ---------------------------------------------------------------------
  [[nodiscard]] bool patience_ended() const {
    return seconds(now_ns() - last_progress_ns_) > options_.patience_s;
  }

  void tell_progress(std::int64_t done) {
    if (options_.progress)
      options_.progress(std::min(1.0, static_cast<double>(done) / options_.frames),
                        fmt::format("{} sets", done));
  }

  void keep_in_step() {
    for (const LiveCamera& camera : file_.cameras)
      if (camera.address.backend == Backend::replay) return;
    for (const NewPhase& late : steps_.look(newest_exposures_s(running_, epoch_ns_), now_ns()))
      begin_again(late.camera, late.phase_s);
  }

  void begin_again(std::size_t c, double phase_s) {
    Running& r = running_[c];
    report_.faults.push_back(
        {name(c),
         fmt::format("it exposes {:.1f} ms beside `{}`: its stream begins again in step",
                     1e3 * phase_s, name(0)),
         "use cameras with a trigger where that is too far apart"});
    r.host->stop();
    r.started = false;
    r.begin_ns = begin_again_ns(r.began_ns, phase_s, 1 / file_.frame_rate_hz,
                                now_ns() + std::llround(1e9 * kStreamEnds_s));
  }

  void run_free() {
    std::int64_t look_at = options_.frames;
    while (!patience_ended() && seconds(now_ns() - streaming_since_ns_) < longest_s()) {
      wait(std::min(0.02, until_next_s(running_, now_ns())));
      take_in();
      keep_in_step();
      const std::int64_t have = least_complete(running_);
      tell_progress(have);
      const bool quiet = seconds(now_ns() - last_progress_ns_) > 2 / file_.frame_rate_hz;
      if (have < look_at && !quiet) continue;
      // One more frame of each, or silence: the last set's best partner has surely come.
      const PairingResult pairing = pair(marks());
      const std::size_t sets = pairing.sets.size();
      drop_old_pixels(pairing);
      const auto wanted = static_cast<std::size_t>(options_.frames);
      if (sets > wanted || (quiet && sets == wanted)) return;
      look_at = have + 1;
    }
  }

  /// Frames so old that no partner will come are only counted: memory stays bounded.
  void drop_old_pixels(const PairingResult& pairing) {
    for (std::size_t i = 0; i < arrivals_.size(); ++i) {
      const bool old = arrivals_[i].index + kPartnersWithin < running_[arrivals_[i].camera].newest;
      if (old && pairing.places[i].bin != FrameBin::in_set)
        std::vector<std::uint8_t>().swap(arrivals_[i].frame.pixels);
    }
  }

  /// So that a bench with a camera that never pairs ends too.
  [[nodiscard]] double longest_s() const {
    return 2 * options_.patience_s + 5 * (options_.frames + 2) / file_.frame_rate_hz;
  }

  void run_triggered() {
    const auto pace_ns = std::llround(1e9 / file_.frame_rate_hz);
    std::int64_t next_ns = now_ns();
    for (int k = 0; k < options_.frames; ++k) {
      while (now_ns() < next_ns) {
        wait(seconds(next_ns - now_ns()));
        take_in();
      }
      next_ns = now_ns() + pace_ns;
      fire();
      await_answers();
      tell_progress(k + 1);
    }
  }

  void fire() {
    ++report_.triggers;
    std::int64_t at = now_ns();
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

  void act(const Running& r, std::optional<std::int64_t> host_ns) {
    std::optional<std::int64_t> device_ns;
    if (host_ns) {
      const auto clock = newest_clock(r.clocks);
      if (!clock) return;
      const auto since = static_cast<double>(*host_ns - clock->reference_host_ns);
      device_ns = clock->reference_device_ns + std::llround(since / (1 + 1e-6 * clock->drift_ppm));
    }
    if (!actions_) actions_ = std::make_unique<ActionSender>(r.host->identity().host_address);
    if (!actions_->send(r.host->identity().address, device_ns))
      report_.faults.push_back(
          {"", "an action command could not be sent", "check the network card"});
  }

  void await_answers() {
    std::vector<std::int64_t> before;
    for (const Running& r : running_) before.push_back(r.newest);
    double exposure_s = 0;
    for (const LiveCamera& c : file_.cameras)
      exposure_s = std::max(exposure_s, 1e-6 * c.settings.exposure_us.value_or(0));
    // A line is pulsed from outside whenever it likes.
    const double allowed =
        report_.method == SyncMethod::line_trigger ? options_.patience_s : exposure_s + kAnswer_s;
    const std::int64_t until = now_ns() + std::llround(1e9 * allowed);
    const auto answered = [&] {
      for (std::size_t c = 0; c < running_.size(); ++c)
        if (running_[c].newest == before[c]) return false;
      return true;
    };
    while (!answered() && now_ns() < until) {
      wait(0.02);
      take_in();
    }
  }

  // ---- what comes out -----------------------------------------------------------------------
  [[nodiscard]] std::optional<double> time_of(
      const Arrival& a, const std::vector<std::optional<ClockFit>>& clocks) const {
    if (!a.frame.device_ns) return std::nullopt;
    if (running_[a.camera].host->on_host_clock()) return seconds(*a.frame.device_ns - epoch_ns_);
    if (!a.clock || !clocks[*a.clock]) return std::nullopt;
    return clocks[*a.clock]->host_time_s(*a.frame.device_ns, epoch_ns_);
  }

  [[nodiscard]] bool by_trigger() const {
    return report_.method != SyncMethod::free_run && report_.method != SyncMethod::line_trigger;
  }

  std::vector<FrameMark> marks() const {
    std::vector<std::vector<std::optional<ClockFit>>> clocks;
    for (const Running& r : running_) clocks.push_back(fit_clocks(r.clocks));
    std::vector<double> triggers;
    for (const std::int64_t t : trigger_ns_) triggers.push_back(seconds(t - epoch_ns_));
    std::vector<FrameMark> result;
    for (const Arrival& a : arrivals_) {
      FrameMark mark{a.camera, a.index, time_of(a, clocks[a.camera]), std::nullopt,
                     a.frame.complete};
      if (by_trigger() && mark.time_s)
        mark.trigger = trigger_of(*mark.time_s, triggers, kTriggerEarly_s, kAnswer_s);
      result.push_back(mark);
    }
    return result;
  }

  PairingResult pair(const std::vector<FrameMark>& frames) const {
    PairingOptions options;
    options.cameras = running_.size();
    options.window_s = window_s();
    if (by_trigger()) options.triggers = report_.triggers;
    return pair_frames(frames, options);
  }

  [[nodiscard]] double window_s() const {
    return std::min(file_.largest_spread_s, 0.4 / file_.frame_rate_hz);
  }

  LiveResult finish() {
    LiveResult result;
    const std::vector<FrameMark> all = marks();
    std::vector<FrameMark> kept;
    const auto wanted = static_cast<std::size_t>(options_.frames);
    const auto counted = by_trigger() ? every_frame(all) : frames_of_sets(all, pair(all), wanted);
    for (const std::size_t i : counted) {
      HostFrame& frame = arrivals_[i].frame;
      kept.push_back(all[i]);
      result.frames.push_back(
          {all[i], frame.width_px, frame.height_px, frame.fault, std::move(frame.pixels)});
    }
    result.pairing = pair(kept);
    for (std::size_t c = 0; c < running_.size(); ++c) {
      const Running& r = running_[c];
      report_.cameras.push_back({name(c), r.host->identity(), r.host->settings(),
                                 r.host->on_host_clock() ? std::nullopt : newest_clock(r.clocks),
                                 result.pairing.cameras[c], r.host->counters(),
                                 r.host->frames_without_room(), r.host->launches(), r.longest_gap_s,
                                 r.longest_unnoticed_s});
    }
    const auto ptp = ptp_faults(report_.cameras);
    report_.faults.insert(report_.faults.end(), ptp.begin(), ptp.end());
    result.report = std::move(report_);
    return result;
  }

  [[nodiscard]] const std::string& name(std::size_t camera) const {
    return file_.cameras[camera].name;
  }

  const CamerasFile& file_;
  const LiveOptions& options_;
  std::int64_t epoch_ns_, last_progress_ns_, streaming_since_ns_ = 0;
  InStep steps_{1 / file_.frame_rate_hz, window_s()};
  std::vector<Running> running_;
  std::vector<Arrival> arrivals_;
  std::vector<std::int64_t> trigger_ns_;
  std::unique_ptr<ActionSender> actions_;
  LiveReport report_;
};

}  // namespace

void LiveOptions::check() const {
  if (frames < 1) throw usage_error("the number of frames must be 1 or more", "give --frames 1");
  if (!(patience_s > 0)) throw usage_error("the patience is not positive", "give some seconds");
}

LiveResult capture_live(const CamerasFile& cameras, const LiveOptions& options) {
  options.check();
  if (cameras.cameras.empty()) throw usage_error("no camera to capture with", "name a camera");
  return Session(cameras, options).run();
}

}  // namespace drape::capture

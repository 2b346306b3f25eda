// SPDX-License-Identifier: Apache-2.0
// One capture from opening the cameras to the report.
#include "capture/live/live_capture.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <cmath>

#include "capture/device/gige_network.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kAnswer_s = 0.5;      ///< largest reaction time to a trigger, above the exposure
constexpr double kLateAnswer_s = 3.0;  ///< the same limit on an overloaded machine
constexpr double kRetryEvery_s = 0.3;  ///< initial delay; grows by half after each failure
constexpr double kRetryAtMost_s = 2;
constexpr int kOpenedInVain = 10;   ///< failed attempts after which it stays closed
constexpr int kTriggersBefore = 3;  ///< test triggers until every camera answers
constexpr std::size_t kMostBytesPerPixel = 3;
constexpr std::size_t kAroundFrame = 1 << 16;  ///< space for chunks and padding
constexpr double kRoom_s =
    1.5;  ///< time span for which the shared memory holds frames while this process is busy
constexpr int kUsualPath_bytes = 1500;  ///< MTU without jumbo frames
constexpr double kStopping_s = 2;
constexpr double kReadings_s = 1;            ///< twice the interval between clock readings
constexpr double kFitEvery_s = 0.4;          ///< interval of the clock readings that are kept
constexpr std::int64_t kPartnersWithin = 8;  ///< later frames until the partners have arrived
constexpr double kLargestDelay_s = 5;        ///< largest delay from exposure to arrival of a frame

/// Remedy for a receive buffer smaller than a frame; empty if it is large enough.
std::string remedy_for_buffer(const CameraHost& host) {
  const auto bytes = [&](const char* name) {
    return std::stoll(setting_in(host.settings(), name).value_or("0"));
  };
  const std::int64_t frame = bytes("receive_buffer_of_a_frame_bytes");
  const bool is_small = setting_in(host.settings(), "stream_socket") == "udp" &&
                        bytes("receive_buffer_bytes") < frame;
  return is_small ? fmt::format("sudo sysctl -w net.core.rmem_max={}", 2 * frame) : "";
}

constexpr double kScheduleAhead_s = 0.03;  ///< lead time in which every camera receives the command
constexpr double kTriggerEarly_s = 2e-3;   ///< tolerated clock error before a trigger
constexpr double kStreamEnds_s = 0.3;      ///< time allowed for a stream to stop

double tick_hz(const CameraHost& host) {
  const auto value = setting_in(host.settings(), "clock_tick_hz");
  return value && value != "not given" ? std::stod(*value) : 1e9;
}

std::int64_t now_ns() {
  return Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

double seconds(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

std::int64_t nanoseconds(double s) {
  return std::llround(1e9 * s);
}

constexpr double kLargest_s = 5e-3;  ///< limit in excess of the uncertainty of both readings

/// Difference of the camera's clock from the host's at host time `at_ns`.
double offset_s(const ClockFit& clock, std::int64_t at_ns) {
  const auto since = static_cast<double>(at_ns - clock.reference_host_ns);
  const auto offset = static_cast<double>(clock.reference_device_ns - clock.reference_host_ns);
  return 1e-9 * (offset - since * 1e-6 * clock.drift_ppm);
}

/// Readings of a camera's clocks: reopening the camera or a jump starts a new
/// list.
using ClockReadings = std::vector<std::vector<ClockSample>>;

std::optional<ClockFit> newest_clock(const ClockReadings& clocks) {
  return clocks.empty() ? std::nullopt : fit_clock(clocks.back());
}

/// Finds faults of PTP: cameras that report PTP synchronisation although their clocks differ by
/// more than the readings explain (one in TAI and one in UTC, two masters, ...), and cameras that
/// should use PTP but do not, so that their offset and drift are estimated.
std::vector<LiveFault> ptp_faults(const std::vector<LiveCameraReport>& cameras) {
  std::vector<LiveFault> faults;
  const LiveCameraReport* first = nullptr;
  for (const LiveCameraReport& camera : cameras) {
    const auto status =
        setting_in(camera.settings, "ptp_status");  // absent unless PTP was requested
    if (status && status != "Slave" && status != "Master") {
      faults.push_back({camera.name,
                        fmt::format("PTP does not hold its clock ({}); offset and drift are "
                                    "estimated instead",
                                    *status),
                        "start a PTP master on this network, or set ptp = false"});
      continue;
    }
    if (!status || !camera.clock) continue;
    if (first == nullptr) {
      first = &camera;
      continue;
    }
    const std::int64_t at_ns = first->clock->reference_host_ns;
    const double apart = offset_s(*camera.clock, at_ns) - offset_s(*first->clock, at_ns);
    if (std::abs(apart) <=
        kLargest_s + camera.clock->offset_bound_s() + first->clock->offset_bound_s())
      continue;
    faults.push_back(
        {camera.name,
         fmt::format("it says that PTP holds its clock, which is {:.3f} s from that of `{}`", apart,
                     first->name),
         "give all cameras the same PTP master and time scale, or switch ptp off"});
  }
  return faults;
}

/// A frame before the clocks have been fitted.
struct Arrival {
  std::size_t camera = 0;
  std::int64_t index = 0;
  std::optional<std::size_t> clock;             ///< index of the clock that stamped it, if certain
  std::optional<std::int64_t> counted_trigger;  ///< trigger answered by a camera without a clock
  std::optional<std::size_t> settled;           ///< index of the set in which it was delivered
  std::int64_t arrived_ns = 0;
  HostFrame frame;
  bool given_up = false;  ///< no partner arrived in time; pixels were dropped
};

/// State of one camera during a capture.
struct Running {
  std::unique_ptr<CameraHost> host;
  FrameIdUnwrapper ids{FrameIdRange{}};
  std::int64_t base = 0;  ///< added to the unwrapped id; grows when the ids restart
  std::int64_t newest = -1;
  std::optional<std::int64_t> newest_device_ns;
  std::int64_t last_frame_ns = 0;  ///< host time, for the watchdog only
  std::int64_t failed_ns = 0;      ///< 0 while it runs
  std::int64_t retry_ns = 0;
  std::int64_t began_ns = 0;  ///< host time of the command to stream
  std::int64_t begin_ns = 0;  ///< earliest time of the next command to stream
  /// Time of the first trigger since its last frame, and number of triggers since, in a session.
  std::int64_t asked_ns = 0;
  int unanswered = 0;
  bool started = false, fresh = true;
  double longest_gap_s = 0, longest_unnoticed_s = 0;
  /// Clock readings; a new list starts when the camera is reopened or its clock jumps.
  ClockReadings clocks;
  std::size_t clock_taken = 0;
  std::optional<ClockSample> last_reading;  ///< latest reading of the newest clock
  std::int64_t sure_from_ns = 0;  ///< earlier arrivals may carry the time of the previous clock
  bool stamps_are_off = false;
  std::int64_t complete = 0;
  int opened_in_vain = 0;  ///< attempts since the last frame
  bool given_up = false;
  /// Reference frame and its trigger, from which triggers are counted without a clock.
  struct Counted {
    std::int64_t index = 0, trigger = 0;
  };
  std::optional<Counted> counted;
  int silent_triggers = 0;  ///< consecutive triggers without an answer
};

/// True if frames of this camera can be paired by device time.
bool has_clock(const Running& camera) {
  return camera.host->on_host_clock() || fit_clock(camera.host->clock_samples()).has_value();
}

/// True if its frames are assigned by counting triggers.
bool never_had_clock(const Running& r) {
  return !r.host->on_host_clock() &&
         std::ranges::all_of(r.clocks, [](const auto& readings) { return readings.empty(); });
}

/// True if the clock was read after the frame arrived, so that a jump detected later cannot affect
/// it.
bool is_confirmed(const Running& r, const Arrival& a) {
  const bool reads = r.last_reading && !r.host->on_host_clock();
  return !reads || r.last_reading->host_before_ns > a.arrived_ns;
}

/// Continues the frame count after a restart, when the device counts from the start again. Frames
/// missed in between are derived from its clock, if that ran on and the frame rate is fixed.
void rebase(Running& r, const HostFrame& frame, std::optional<double> frame_rate_hz) {
  if (r.newest < 0) return;
  r.base = r.newest + 1;
  if (!frame.device_ns || !r.newest_device_ns || !frame_rate_hz) return;
  const double frames = seconds(*frame.device_ns - *r.newest_device_ns) * *frame_rate_hz;
  if (frames > 1.5 && frames < 1e6) r.base = r.newest + std::llround(frames);
}

std::optional<LiveFault> without_clock(const std::vector<Running>& cameras, const CamerasFile& file,
                                       SyncMethod method) {
  const bool scheduled = method == SyncMethod::scheduled_action;
  const bool by_time = method == SyncMethod::free_run || method == SyncMethod::line_trigger;
  if (!scheduled && (!by_time || file.pair_by_arrival || cameras.size() == 1)) return std::nullopt;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (has_clock(cameras[c])) continue;
    return LiveFault{file.cameras[c].name,
                     scheduled ? "its clock cannot be read"
                               : "its clock cannot be read, so that its frames cannot be paired by "
                                 "time",
                     scheduled ? "use another sync method"
                               : "use software_trigger, or pair_by_arrival = true in [sync]"};
  }
  return std::nullopt;
}

/// Detects a camera that is named twice, once by serial number: its second host waits in vain.
std::optional<LiveFault> one_device_twice(const std::vector<Running>& cameras,
                                          const CamerasFile& file) {
  for (std::size_t a = 0; a < cameras.size(); ++a)
    for (std::size_t b = 0; b < cameras.size(); ++b) {
      const CameraAddress& other = file.cameras[b].address;
      if (a == b || !cameras[a].host->ready() || other.device.empty() ||
          other.backend == Backend::replay || other.backend != file.cameras[a].address.backend)
        continue;
      const CameraIdentity& is = cameras[a].host->identity();
      if (other.device != is.serial && other.device != is.address) continue;
      return LiveFault{
          file.cameras[b].name,
          fmt::format("cameras `{}` and `{}` of {} are the same device: serial number "
                      "{}, address {}",
                      file.cameras[std::min(a, b)].name, file.cameras[std::max(a, b)].name,
                      file.file.filename().string(), is.serial, is.address),
          "give each [[camera]] a device of its own"};
    }
  return std::nullopt;
}

constexpr int kMostTimes = 10;
constexpr std::int64_t kOutOfStep_ns = 1'200'000'000;

/// A camera that must be restarted, with the delay of its exposure after camera 0.
struct NewPhase {
  std::size_t camera = 0;
  double phase_s = 0;
};

/// Monitors free-running cameras and finds those that never expose with the others.
class InStep {
 public:
  /// `window_s` is the largest spread of a set.
  InStep(double period_s, double window_s) : period_s_(period_s), window_s_(window_s) {}

  /// Takes `exposed_s` as phases_s() does, absent while a camera's is unknown. Reports a camera
  /// that was out of step for 1.2 s (which excludes a clock that just jumped), at most ten times in
  /// all: cameras of different rates cannot be brought into step.
  [[nodiscard]] std::vector<NewPhase> look(const std::optional<std::vector<double>>& exposed_s,
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

 private:
  double period_s_, window_s_;
  std::int64_t looked_ns_ = 0, out_of_step_since_ns_ = 0;
  int named_ = 0;
};

/// Runs one capture from opening the cameras to the result.
class Session {
 public:
  Session(const CamerasFile& cameras, const LiveOptions& options)
      : file_(cameras), options_(options), epoch_ns_(now_ns()), last_progress_ns_(epoch_ns_) {
    for (const LiveCamera& camera : file_.cameras) {
      HostOptions host;
      host.program = options_.host_program;
      host.memory_limit_mb = options_.memory_limit_mb;
      host.opening_s = options_.opening_s;
      // A replay has no cable to unplug; its host is only silent if the machine is busy.
      if (camera.address.backend == Backend::replay) host.silence_s = host.opening_s;
      host.slots = std::clamp<std::size_t>(std::lround(kRoom_s * file_.frame_rate_hz), 8, 64);
      // Allocates for the largest pixel format; memory pages that are never written cost nothing.
      host.slot_bytes = static_cast<std::size_t>(*camera.settings.width_px) *
                            static_cast<std::size_t>(*camera.settings.height_px) *
                            kMostBytesPerPixel +
                        kAroundFrame;
      auto& running = running_.emplace_back();
      running.host = std::make_unique<CameraHost>(camera.address, camera.settings, host);
    }
  }

  LiveResult run() {
    open_with_fall_backs();
    streaming_since_ns_ = last_progress_ns_ = now_ns();
    report_.method == SyncMethod::free_run ? run_free() : run_triggered();
    stop_streams();
    return finish();
  }

 private:
  void open_with_fall_backs() {
    std::vector<SyncMethod> methods = {file_.method};
    methods.insert(methods.end(), file_.fall_backs.begin(), file_.fall_backs.end());
    for (std::size_t i = 0;; ++i) {
      report_.method = methods[i];
      arrivals_.clear();
      for (Running& r : running_) {
        r.newest = -1;
        r.newest_device_ns.reset();
        r.clocks.clear();
        r.last_reading.reset();
        r.started = false;
      }
      auto refused = open_all();
      if (!refused) refused = begin_streams();
      if (!refused) return;
      if (i + 1 == methods.size())
        throw Error(ErrorKind::device, refused->what, {.camera = refused->camera},
                    refused->what_to_do);
      report_.why_fallen_back +=
          fmt::format("{}{}: camera `{}`: {}", report_.why_fallen_back.empty() ? "" : "; ",
                      name_of(methods[i]), refused->camera, refused->what);
    }
  }

  /// Starts each camera's host for the sync method and waits until all are ready. Returns why the
  /// method cannot be used: a camera refuses it, does not open, or has no readable clock although
  /// the method needs one. No frames are expected in that case.
  std::optional<LiveFault> open_all() {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      CameraSettings settings = file_.cameras[c].settings;
      settings.trigger = trigger_of(report_.method);
      running_[c].host->set_settings(settings);
      running_[c].host->launch();
    }
    const std::int64_t until = now_ns() + nanoseconds(options_.opening_s);
    // By then a host has finished discovery and reports duplicate serial numbers itself.
    const std::int64_t listed = now_ns() + nanoseconds(5);
    for (;;) {
      wait(0.02);
      for (const Running& r : running_) r.host->pump();
      for (std::size_t c = 0; c < running_.size(); ++c) {
        const CameraHost& host = *running_[c].host;
        if (host.fault()) return LiveFault{name(c), *host.fault(), host.what_to_do()};
        if (!host.ready() && now_ns() > until)
          return LiveFault{name(c), "it does not open", "check cable and power of the camera"};
      }
      if (now_ns() > listed)
        if (auto twice = one_device_twice(running_, file_)) return twice;
      if (all([](const Running& r) { return r.host->ready(); }))
        return without_clock(running_, file_, report_.method);
    }
  }

  template <class Is>
  [[nodiscard]] bool all(Is is) const {
    return std::ranges::all_of(running_, is);
  }
  template <class Is>
  [[nodiscard]] bool any(Is is) const {
    return std::ranges::any_of(running_, is);
  }

  /// Waits for a message of any camera host; returns at once if a frame is ready.
  void wait(double timeout_s) const {
    if (any([](const Running& r) { return r.host->has_frame(); })) return;
    std::vector<pollfd> descriptors;
    for (const Running& r : running_) descriptors.push_back({r.host->descriptor(), POLLIN, 0});
    ::poll(descriptors.data(), descriptors.size(), static_cast<int>(std::ceil(1e3 * timeout_s)));
  }

  /// Processes messages until `done` returns true, for at most `most_s`.
  template <class Done>
  void take_in_until(double most_s, Done done) {
    const std::int64_t until = now_ns() + nanoseconds(most_s);
    while (now_ns() < until && !done()) {
      wait(0.02);
      take_in();
    }
  }

  /// Starts all streams and, with software triggers, makes sure that every camera answers. These
  /// frames belong to no set: in many cameras the first frame of a stream is slow.
  std::optional<LiveFault> begin_streams() {
    report_.paired_by = by_trigger()                               ? PairedBy::trigger
                        : all(has_clock) && !file_.pair_by_arrival ? PairedBy::time
                                                                   : PairedBy::arrival;
    for (Running& r : running_) start(r);
    // Triggers only once all cameras stream; an earlier one would reach only some of them.
    take_in_until(options_.opening_s, [&] {
      return all([](const Running& r) { return r.host->started() || r.host->fault(); });
    });
    if (!by_trigger()) return std::nullopt;
    for (int k = 0; k < kTriggersBefore; ++k) {
      fire();
      ++report_.triggers_before;
      await_answers(k + 1 < kTriggersBefore ? kAnswer_s : kLateAnswer_s,
                    all(has_clock) ? 0 : kAnswer_s);
      if (all([](const Running& r) { return r.newest >= 0 || r.host->fault(); })) break;
    }
    for (std::size_t c = 0; c < running_.size(); ++c) {
      Running& r = running_[c];
      if (r.host->fault()) return LiveFault{name(c), *r.host->fault(), r.host->what_to_do()};
      if (r.newest < 0)
        return LiveFault{name(c), fmt::format("it answers no {}", name_of(report_.method)),
                         remedy_for_silence(*r.host) + "; or try another sync method"};
      r.counted = Running::Counted{r.newest, -1};
      r.complete = 0;
    }
    arrivals_.clear();
    trigger_ns_.clear();
    report_.triggers = 0;
    return std::nullopt;
  }

  [[nodiscard]] double period_s() const { return 1 / file_.frame_rate_hz; }

  void start(Running& r) {
    r.ids = FrameIdUnwrapper(r.host->frame_ids());
    r.base = r.newest + 1;
    r.fresh = true;
    r.started = true;
    r.clock_taken = 0;
    r.counted.reset();
    r.clocks.emplace_back();
    r.last_reading.reset();
    r.unanswered = 0;
    r.last_frame_ns = r.began_ns = now_ns();
    r.host->start();
  }

  /// Waits for the final packet counts; frames that still arrive are not part of the capture.
  void stop_streams() {
    while (any([](const Running& r) { return r.host->has_frame(); })) take_in();
    for (Running& r : running_) r.host->stop();
    const std::int64_t until = now_ns() + nanoseconds(kStopping_s);
    const auto stopped = [](const Running& r) { return !r.host->started() || r.host->fault(); };
    while (now_ns() < until && !all(stopped)) {
      wait(0.02);
      for (Running& r : running_) r.host->pump();
    }
    for (std::size_t c = 0; c < running_.size(); ++c) take_readings(c);
  }

  void take_in() {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      Running& r = running_[c];
      r.host->pump();
      take_readings(c);
      if (const auto answer = r.host->light_answer(); answer && options_.on_light)
        options_.on_light(c, *r.host, *answer);
      // Takes one frame per camera at a time; the rest wait in shared memory, which is bounded.
      if (auto frame = r.host->next_frame()) take_frame(c, std::move(*frame));
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
    const auto before = std::exchange(r.last_reading, sample);
    const auto jump = before ? clock_jump_s(*before, sample) : std::nullopt;
    if (!jump) {
      // A subset of the readings, taken after every frame, suffices for the fit.
      const bool soon = r.newest >= 0 && !clock.empty() &&
                        seconds(sample.host_before_ns - clock.back().host_before_ns) < kFitEvery_s;
      if (!soon) clock.push_back(sample);
      return;
    }
    note(c, fmt::format("its clock jumped by {:.3f} s; frames around that have no time", *jump),
         "let nothing set the camera's clock during a capture (PTP, other programs)");
    const std::int64_t last_good_ns = before->host_before_ns;
    for (Arrival& a : arrivals_)
      if (a.camera == c && a.arrived_ns >= last_good_ns) a.clock.reset();
    r.sure_from_ns = now_ns() + nanoseconds(kAnswer_s);
    r.clocks.push_back({sample});
  }

  /// Waits until each clock used for pairing has been read after its last frame.
  void await_readings() {
    const std::int64_t from = now_ns();  // ignores later frames, or it would never end
    take_in_until(kReadings_s, [&] {
      return by_trigger() || interrupted() || std::ranges::all_of(arrivals_, [&](const Arrival& a) {
               const Running& r = running_[a.camera];
               return a.settled || a.arrived_ns > from || r.host->fault() || is_confirmed(r, a);
             });
    });
  }

  /// Detects a driver whose time stamps are not on the host's clock as claimed.
  void check_stamp(std::size_t c, HostFrame& frame) {
    if (file_.cameras[c].address.backend != Backend::v4l2 || !frame.device_ns) return;
    const double off_s = seconds(*frame.device_ns - now_ns());
    if (std::abs(off_s) < kLargestDelay_s) return;
    frame.device_ns.reset();
    if (std::exchange(running_[c].stamps_are_off, true)) return;
    note(c, fmt::format("its time stamps are {:.0f} s off the host's clock", off_s),
         "unplug and plug the camera; until then its frames cannot be paired by time");
  }

  void take_frame(std::size_t c, HostFrame frame) {
    Running& r = running_[c];
    const auto unwrapped = r.ids.unwrap(frame.id);
    if (!unwrapped)
      return note(c, "a frame has an id that no camera gives",
                  "look for junk on the camera's network; else replace the camera");
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
      tell({name(c),
            fmt::format("it sends frames again after {:.1f} s", seconds(now_ns() - r.failed_ns)),
            ""});
      r.failed_ns = 0;
    }
    r.opened_in_vain = r.unanswered = 0;
    if (frame.complete) {
      ++r.complete;
    } else {
      note(c, "a frame is incomplete: " + frame.fault, remedy_for(*r.host));
    }
    if (options_.on_frame && frame.complete && !r.host->has_frame())
      options_.on_frame(c, frame, *r.host);
    if (!options_.keep_pixels) frame.pixels = {};
    std::optional<std::size_t> clock;
    if (r.last_frame_ns >= r.sure_from_ns && !r.clocks.empty()) clock = r.clocks.size() - 1;
    const auto counted = count_trigger(r, index);
    give_up_old_frames(c);
    arrivals_.push_back(
        {c, index, clock, counted, std::nullopt, r.last_frame_ns, std::move(frame)});
  }

  /// Drops the pixels of frames too old to find a partner and only counts them, so that memory
  /// stays bounded for any camera.
  void give_up_old_frames(std::size_t c) {
    std::optional<PairingResult> paired;
    if (!options_.on_set) {  // otherwise the result needs the frames of all sets
      const auto kept = std::ranges::count_if(
          arrivals_, [c](const Arrival& a) { return a.camera == c && !a.frame.pixels.empty(); });
      if (kept <= options_.frames + kPartnersWithin) return;
      paired = pair(marks());
    }
    for (std::size_t i = 0; i < arrivals_.size(); ++i) {
      Arrival& a = arrivals_[i];
      const bool old = a.camera == c && a.index + kPartnersWithin < running_[c].newest;
      if (!old || a.settled || a.given_up) continue;
      if (paired && paired->places[i].bin == FrameBin::in_set) continue;
      a.given_up = true;
      std::vector<std::uint8_t>().swap(a.frame.pixels);
    }
  }

  /// Trigger answered by a frame of a camera without a clock: the latest one, if the camera sent as
  /// many frames as triggers since a frame with a known trigger. nullopt if one is missing: a late
  /// frame and a skipped exposure cannot be told apart.
  std::optional<std::int64_t> count_trigger(Running& r, std::int64_t index) const {
    const std::int64_t last = last_trigger();
    if (!by_trigger() || last < 0 || !r.counted) return std::nullopt;
    if (index - r.counted->index != last - r.counted->trigger) return std::nullopt;
    r.counted = Running::Counted{index, last};
    return last;
  }

  std::string remedy_for(const CameraHost& host) {
    if (std::string buffer = remedy_for_buffer(host); !buffer.empty()) return buffer;
    const auto packet = setting_in(host.settings(), "packet_size_bytes");
    if (packet && std::stoll(*packet) > kUsualPath_bytes)
      return fmt::format(
          "packet_size_bytes = {}, where a switch or card carries no larger ones; else "
          "raise packet_delay_ns, or lower frame_rate_hz",
          kUsualPath_bytes);
    return "raise packet_delay_ns, or lower frame_rate_hz; check cable and switch";
  }

  /// Remedy for a camera that obeys commands but sends no frames, or none that fit the receive
  /// buffer.
  std::string remedy_for_silence(const CameraHost& host) {
    if (host.identity().host_address.empty()) return "check cable and power of the camera";
    const std::string buffer = remedy_for_buffer(host);
    return fmt::format(
        "it obeys, but none of its pictures comes: {}let the firewall pass UDP from {} (`sudo nft "
        "list ruleset` shows it), and check cable and power",
        buffer.empty() ? "" : buffer + "; ", host.identity().address);
  }

  /// True if a streaming camera sends nothing although a frame is due.
  bool is_silent(std::size_t c) const {
    const Running& r = running_[c];
    const bool live = file_.cameras[c].address.backend != Backend::replay;
    if (!live || !r.started || !r.host->ready() || r.host->fault()) return false;
    const std::int64_t now = now_ns();
    if (report_.method == SyncMethod::free_run)
      return seconds(now - r.last_frame_ns) > 2 / file_.frame_rate_hz + 0.5;
    // Tolerates one lost trigger and one late answer.
    const double exposure_s = 1e-6 * r.host->wanted().exposure_us.value_or(0);
    return r.unanswered > 1 && seconds(now - r.asked_ns) > exposure_s + kLateAnswer_s &&
           seconds(now - trigger_ns_.back()) > exposure_s + kAnswer_s;
  }

  /// Detects a lost camera and restarts it while the others continue.
  void look_after(std::size_t c) {
    Running& r = running_[c];
    const std::int64_t now = now_ns();
    if (r.host->fault() || is_silent(c)) {
      if (r.started) {
        const LiveFault fault = {name(c), r.host->fault().value_or("it stopped sending frames"),
                                 r.host->fault()
                                     ? r.host->what_to_do() + "; it is opened again"
                                     : remedy_for_silence(*r.host) + "; it is opened again"};
        add_fault(report_.faults, fault);
        if (r.failed_ns == 0) tell(fault);
        if (r.failed_ns == 0) r.failed_ns = now;
        r.longest_unnoticed_s = std::max(r.longest_unnoticed_s, seconds(now - r.last_frame_ns));
        r.started = false;
        r.retry_ns = now;
      }
      if (now >= r.retry_ns && !r.given_up) open_again(c);
    } else if (!r.started && r.host->ready() && now >= r.begin_ns) {
      // If it is still stopping its stream, it starts one period later, with the same phase.
      r.host->started() ? void(r.begin_ns += nanoseconds(period_s())) : start(r);
    }
  }

  void open_again(std::size_t c) {
    Running& r = running_[c];
    // In a session the operator sees that a camera is lost and has time to repair it.
    r.given_up = !options_.demand && r.opened_in_vain == kOpenedInVain;
    if (r.given_up) {
      note(c,
           fmt::format("it was opened {} times and gave no frame: {}", kOpenedInVain,
                       r.host->fault().value_or("it stays silent")),
           r.host->fault() ? r.host->what_to_do() : remedy_for_silence(*r.host));
      return;
    }
    const double wait_s =
        std::min(kRetryAtMost_s, kRetryEvery_s * std::pow(1.5, r.opened_in_vain++));
    r.retry_ns = now_ns() + nanoseconds(wait_s);
    r.host->launch();
  }

  bool patience_ended() const {
    if (interrupted()) return true;
    return any([](const Running& r) { return r.given_up; }) ||
           seconds(now_ns() - last_progress_ns_) > options_.patience_s;
  }

  void tell_progress(std::int64_t done) {
    if (options_.progress)
      options_.progress(std::min(1.0, static_cast<double>(done) / options_.frames),
                        fmt::format("{} sets", done));
  }

  void keep_in_step() {
    for (const LiveCamera& camera : file_.cameras)
      if (camera.address.backend == Backend::replay) return;
    for (const NewPhase& late : steps_.look(newest_exposures_s(), now_ns()))
      begin_again(late.camera, late.phase_s);
  }

  /// Latest exposure of each camera on the host's clock; nullopt if one is unknown.
  [[nodiscard]] std::optional<std::vector<double>> newest_exposures_s() const {
    std::vector<double> result;
    for (const Running& r : running_) {
      if (!r.started || r.fresh || !r.newest_device_ns) return std::nullopt;
      const auto clock = r.host->on_host_clock() ? std::nullopt : newest_clock(r.clocks);
      if (!clock && !r.host->on_host_clock()) return std::nullopt;
      result.push_back(clock ? clock->host_time_s(*r.newest_device_ns, epoch_ns_)
                             : seconds(*r.newest_device_ns - epoch_ns_));
    }
    return result;
  }

  void begin_again(std::size_t c, double phase_s) {
    Running& r = running_[c];
    note(c,
         fmt::format("it exposes {:.1f} ms beside `{}`: its stream begins again in step",
                     1e3 * phase_s, name(0)),
         "use cameras with a trigger where that is too far apart");
    r.host->stop();
    r.started = false;
    r.begin_ns = begin_again_ns(r.began_ns, phase_s, 1 / file_.frame_rate_hz,
                                now_ns() + nanoseconds(kStreamEnds_s));
  }

  void run_free() {
    std::int64_t look_at = options_.on_set ? 1 : options_.frames;
    while (!patience_ended() && seconds(now_ns() - streaming_since_ns_) < longest_s()) {
      double next_s = 0.02;  // time until a waiting camera is due to start
      for (const Running& r : running_)
        if (!r.started && r.begin_ns > now_ns())
          next_s = std::min(next_s, seconds(r.begin_ns - now_ns()));
      wait(next_s);
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
      const std::int64_t have =
          std::ranges::min_element(running_, {}, &Running::complete)->complete;
      tell_progress(have);
      const bool quiet = seconds(now_ns() - last_progress_ns_) > 2 / file_.frame_rate_hz;
      if (have < look_at && !quiet) continue;
      // After one more frame of each camera, or silence, the last set's best partners have arrived.
      const PairingResult pairing = pair(marks());
      const std::size_t sets = pairing.sets.size();
      give_out(pairing, quiet);
      const auto wanted = static_cast<std::size_t>(options_.frames);
      if (sets > wanted || (quiet && sets == wanted)) return;
      look_at = options_.demand ? 0 : have + 1;
    }
  }

  /// Delivers sets that are final: every camera has sent a later complete frame or all are silent
  /// and, if paired by time, each clock was read since, which reveals jumps.
  void give_out(const PairingResult& pairing, bool all) {
    if (!options_.on_set) return;
    for (const PairedFrames& set : pairing.sets) {
      if (given_out_ == static_cast<std::size_t>(options_.frames)) return;
      const auto sure = [&](std::size_t i) {
        const Arrival& a = arrivals_[i];
        const bool confirmed = by_trigger() || ended_ || is_confirmed(running_[a.camera], a);
        return confirmed && (all || a.index < running_[a.camera].newest);
      };
      if (arrivals_[set.frames.front()].settled) continue;
      if (!std::ranges::all_of(set.frames, sure)) return;
      LiveSet live = set_of(set);
      for (const std::size_t i : set.frames) arrivals_[i].settled = given_out_;
      ++given_out_;
      options_.on_set(std::move(live), report_up_to_now(pairing));
    }
  }

  /// Develops the frames of a set; moves their pixels out.
  LiveSet set_of(const PairedFrames& set) {
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
    // Bounded by the time from sending the trigger to the arrival of the last frame.
    if (!live.spread_s && set.trigger)
      live.spread_bound_s = seconds(last_ns - trigger_ns_[static_cast<std::size_t>(*set.trigger)]);
    return live;
  }

  /// Time limit, so that a bench with a camera that never pairs ends too.
  double longest_s() const {
    return 2 * options_.patience_s + 5 * (options_.frames + 2) / file_.frame_rate_hz;
  }

  /// Waits until the operator requests a set; false once no more are wanted.
  bool await_demand() {
    if (!options_.demand) return true;
    std::int64_t next_ns = 0;
    while (!interrupted()) {
      const auto demand = options_.demand();
      if (demand == LiveOptions::Demand::end) return false;
      if (demand == LiveOptions::Demand::take) return true;
      set_light();
      if (options_.on_frame && by_trigger() && now_ns() >= next_ns) {
        next_ns = now_ns() + nanoseconds(period_s());
        trigger_for_screen();
      }
      wait(0.02);
      take_in();
      forget_unsettled();
    }
    return false;
  }

  void set_light() {
    if (!options_.light) return;
    while (const auto light = options_.light())
      running_[light->camera].host->set_light(light->wanted);
  }

  /// Triggers for display; counts each one, so that a late frame is not taken for the next.
  void trigger_for_screen() {
    fire();
    --report_.triggers;
    ++report_.triggers_before;
    await_answers(kAnswer_s);
    settle_counts();
  }

  /// Discards free-running frames from before the operator's request.
  void forget_unsettled() {
    std::erase_if(arrivals_, [](const Arrival& a) { return !a.settled; });
    last_progress_ns_ = streaming_since_ns_ = now_ns();
  }

  void run_triggered() {
    const auto pace_ns = nanoseconds(period_s());
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

  void fire() {
    ++report_.triggers;
    std::int64_t at = now_ns();
    for (Running& r : running_)
      if (streaming_since_ns_ > 0 && r.unanswered++ == 0) r.asked_ns = at;
    if (report_.method == SyncMethod::software_trigger) {
      for (Running& r : running_) r.host->trigger();
    } else if (report_.method == SyncMethod::action) {
      for (const Running& r : running_) act(r, std::nullopt);
    } else if (report_.method == SyncMethod::scheduled_action) {
      at += nanoseconds(kScheduleAhead_s);
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
    // Cameras count ticks of their own; under PTP they count ns and report this.
    if (device_ns)
      device_ns = std::llroundl(static_cast<long double>(*device_ns) * tick_hz(*r.host) / 1e9L);
    if (!actions_) actions_ = std::make_unique<ActionSender>(r.host->identity().host_address);
    if (!actions_->send(r.host->identity().address, device_ns))
      add_fault(report_.faults,
                {"", "an action command could not be sent", "check the network card"});
  }

  /// If a camera without a clock misses a trigger, a late frame could be taken for the next answer:
  /// counting restarts after a long silence.
  void settle_counts() {
    for (Running& r : running_) {
      const std::int64_t last = last_trigger();
      if (!never_had_clock(r) || !by_trigger() || r.host->fault()) continue;
      if (r.counted && r.counted->trigger == last) {
        r.silent_triggers = 0;
        continue;
      }
      if (++r.silent_triggers < 2) continue;
      // After this time without a late frame, the next frame answers the next trigger.
      const std::int64_t before = r.newest;
      take_in_until(kLateAnswer_s, [&] { return r.newest != before; });
      if (r.newest != before) continue;
      r.counted = Running::Counted{r.newest, last};
      r.silent_triggers = 0;
    }
  }

  /// Waits until every connected camera has sent a frame or the time is up, then until no frame
  /// arrived for `quiet_s`.
  void await_answers(double within_s, double quiet_s = 0) {
    std::vector<std::int64_t> before;
    for (const Running& r : running_) before.push_back(r.newest);
    double exposure_s = 0;
    for (const Running& r : running_)
      exposure_s = std::max(exposure_s, 1e-6 * r.host->wanted().exposure_us.value_or(0));
    // A line trigger is pulsed externally at any time.
    const double allowed =
        report_.method == SyncMethod::line_trigger ? options_.patience_s : exposure_s + within_s;
    const std::int64_t until = now_ns() + nanoseconds(allowed);
    const auto answered = [&] {
      for (std::size_t c = 0; c < running_.size(); ++c) {
        const Running& r = running_[c];
        // A session continues without a lost camera; a counted trigger waits for a reopened one.
        const bool away = r.host->fault() || (options_.demand && !r.started);
        if (r.newest == before[c] && !away) return false;
      }
      return true;
    };
    std::int64_t quiet_from = now_ns();
    const auto is_quiet = [&] {
      for (const Running& r : running_) quiet_from = std::max(quiet_from, r.last_frame_ns);
      return now_ns() - quiet_from >= nanoseconds(quiet_s);
    };
    while (!interrupted() && now_ns() < until + nanoseconds(quiet_s) &&
           ((now_ns() < until && !answered()) || !is_quiet())) {
      wait(0.02);
      take_in();
    }
  }

  std::optional<double> time_of(const Arrival& a,
                                const std::vector<std::optional<ClockFit>>& clocks) const {
    if (report_.paired_by == PairedBy::arrival) return seconds(a.arrived_ns - epoch_ns_);
    if (!a.frame.device_ns) return std::nullopt;
    if (running_[a.camera].host->on_host_clock()) return seconds(*a.frame.device_ns - epoch_ns_);
    if (!a.clock || !clocks[*a.clock]) return std::nullopt;
    return clocks[*a.clock]->host_time_s(*a.frame.device_ns, epoch_ns_);
  }

  bool by_trigger() const {
    return report_.method != SyncMethod::free_run && report_.method != SyncMethod::line_trigger;
  }

  std::vector<FrameMark> marks() const {
    std::vector<std::vector<std::optional<ClockFit>>> clocks;
    for (const Running& r : running_)
      for (clocks.emplace_back(); const auto& readings : r.clocks)
        clocks.back().push_back(fit_clock(readings));
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

  PairingResult pair(const std::vector<FrameMark>& frames) const {
    PairingOptions options{.cameras = running_.size(), .window_s = window_s()};
    if (by_trigger()) options.triggers = report_.triggers;
    if (options_.demand && !by_trigger()) options.expected_frames = 0;  // all that were observed
    return pair_frames(frames, options);
  }

  double window_s() const { return std::min(file_.largest_spread_s, 0.4 / file_.frame_rate_hz); }

  void add_cameras(LiveReport& report, const PairingResult& pairing) const {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      const Running& r = running_[c];
      report.cameras.push_back({name(c), r.host->identity(), r.host->settings(),
                                r.host->on_host_clock() ? std::nullopt : newest_clock(r.clocks),
                                pairing.cameras[c], r.host->counters(),
                                r.host->frames_without_room(), r.host->launches(), r.longest_gap_s,
                                r.longest_unnoticed_s});
    }
  }

  [[nodiscard]] LiveReport report_up_to_now(const PairingResult& pairing) const {
    LiveReport report = report_;
    add_cameras(report, pairing);
    return report;
  }

  LiveResult finish() {
    LiveResult result;
    ended_ = true;
    const std::vector<FrameMark> all = marks();
    const PairingResult pairing = pair(all);
    give_out(pairing, true);
    std::vector<FrameMark> kept;
    const auto wanted = static_cast<std::size_t>(by_trigger() ? 0 : options_.frames);
    for (const std::size_t i : frames_of_sets(all, pairing, wanted)) {
      Arrival& a = arrivals_[i];
      kept.push_back(all[i]);
      kept.back().settled = a.settled;
      LiveFrame frame = develop(std::move(a.frame), running_[a.camera].host->pixel_format());
      frame.mark = kept.back();
      result.frames.push_back(std::move(frame));
    }
    result.pairing = pair(kept);
    add_cameras(report_, result.pairing);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      const FramePlace& place = result.pairing.places[i];
      if (place.bin == FrameBin::unpaired)
        add_fault(report_.faults,
                  {name(kept[i].camera),
                   fmt::format("a frame is in no set: {}", name_of(place.why_unpaired)),
                   remedy_for(place.why_unpaired)});
    }
    for (const LiveCameraReport& camera : report_.cameras)
      for (std::int64_t k = 0; k < camera.ledger.never_arrived; ++k)
        add_fault(report_.faults, {camera.name, "a frame never arrived",
                                   "check cable and switch; look for dropped packets on the "
                                   "network card"});
    for (std::size_t c = 0; c < running_.size(); ++c)
      if (report_.method == SyncMethod::line_trigger && running_[c].newest < 0)
        note(c, "no pulse came by the line: it sent no frame",
             "see that pulses come by " + file_.cameras[c].settings.trigger_line);
    for (LiveFault& fault : ptp_faults(report_.cameras)) add_fault(report_.faults, fault);
    if (report_.paired_by == PairedBy::arrival) {
      for (PairedFrames& set : result.pairing.sets) set.spread_s.reset();
      for (LiveFrame& frame : result.frames) frame.mark.time_s.reset();
    }
    result.report = std::move(report_);
    return result;
  }

  [[nodiscard]] bool interrupted() const { return options_.ended && options_.ended(); }

  [[nodiscard]] std::int64_t last_trigger() const {
    return static_cast<std::int64_t>(trigger_ns_.size()) - 1;
  }

  void note(std::size_t camera, std::string what, std::string what_to_do) {
    add_fault(report_.faults, {name(camera), std::move(what), std::move(what_to_do)});
  }

  void tell(const LiveFault& fault) const {
    if (options_.on_camera) options_.on_camera(fault);
  }

  [[nodiscard]] std::string remedy_for(Unpaired why) const {
    if (why == Unpaired::partner_missing && !by_trigger())
      return "use a trigger, or cameras of one frame rate";
    constexpr const char* kRemedies[] = {
        "", "see why the other cameras have no frame of that trigger",
        "look for a switch that sends packets twice; else replace the camera",
        "let nothing set the camera's clock; or use software_trigger",
        "let nothing else trigger the camera, and lower frame_rate_hz"};  // by reason
    return kRemedies[static_cast<std::size_t>(why)];
  }

  const std::string& name(std::size_t camera) const { return file_.cameras[camera].name; }

  const CamerasFile& file_;
  const LiveOptions& options_;
  std::int64_t epoch_ns_, last_progress_ns_, streaming_since_ns_ = 0;
  InStep steps_{1 / file_.frame_rate_hz, window_s()};
  std::vector<Running> running_;
  std::vector<Arrival> arrivals_;
  std::vector<std::int64_t> trigger_ns_;
  std::unique_ptr<ActionSender> actions_;
  std::size_t given_out_ = 0;
  bool ended_ = false;  ///< no further reading will arrive
  LiveReport report_;
};

}  // namespace

void add_fault(std::vector<LiveFault>& faults, LiveFault fault) {
  const auto same = std::ranges::find_if(
      faults, [&](const LiveFault& f) { return f.camera == fault.camera && f.what == fault.what; });
  if (same == faults.end()) {
    faults.push_back(std::move(fault));
  } else {
    ++same->times;
  }
}

LiveResult capture_live(const CamerasFile& cameras, const LiveOptions& options) {
  if (cameras.cameras.empty()) throw usage_error("no camera to capture with", "name a camera");
  return Session(cameras, options).run();
}

}  // namespace drape::capture

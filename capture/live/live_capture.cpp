// SPDX-License-Identifier: Apache-2.0
// One capture from opening the cameras to its report.
#include "capture/live/live_capture.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "capture/device/gige_network.hpp"
#include "capture/live/develop.hpp"
#include "capture/live/phases.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kAnswer_s = 0.5;      ///< to a trigger, above the exposure
constexpr double kLateAnswer_s = 3.0;  ///< the same on a machine that is starved
constexpr double kRetryEvery_s = 0.3;  ///< at first; half as much again after each time in vain
constexpr double kRetryAtMost_s = 2;
constexpr int kOpenedInVain = 10;   ///< failed attempts, after which it stays closed
constexpr int kTriggersBefore = 3;  ///< until every camera answers
constexpr std::size_t kMostBytesPerPixel = 3;
constexpr std::size_t kAroundFrame = 1 << 16;  ///< chunks, padding
constexpr double kRoom_s =
    1.5;  ///< room for frames that wait in shared memory while this process does
constexpr int kUsualPath_bytes = 1500;  ///< without jumbo frames
constexpr double kStopping_s = 2;
constexpr double kReadings_s = 1;            ///< twice the time between two readings of a clock
constexpr double kFitEvery_s = 0.4;          ///< readings of a clock that are kept
constexpr std::int64_t kPartnersWithin = 8;  ///< frames of the same camera
constexpr double kLargestDelay_s = 5;        ///< between exposure and arrival of a frame

/// Empty where the camera's receive buffer holds a whole frame.
std::string remedy_for_buffer(const CameraHost& host) {
  const auto bytes = [&](const char* name) {
    return std::stoll(setting_in(host.settings(), name).value_or("0"));
  };
  const std::int64_t frame = bytes("receive_buffer_of_a_frame_bytes");
  const bool is_small = setting_in(host.settings(), "stream_socket") == "udp" &&
                        bytes("receive_buffer_bytes") < frame;
  return is_small ? fmt::format("sudo sysctl -w net.core.rmem_max={}", 2 * frame) : "";
}

constexpr double kScheduleAhead_s = 0.03;  ///< until every camera surely holds the command
constexpr double kTriggerEarly_s = 2e-3;   ///< clock error allowed before a trigger
constexpr double kStreamEnds_s = 0.3;      ///< once asked to

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

constexpr double kLargest_s = 5e-3;  ///< beyond the uncertainty of both readings

/// The camera's clock minus the host's at the host time `at_ns`.
double offset_s(const ClockFit& clock, std::int64_t at_ns) {
  const auto since = static_cast<double>(at_ns - clock.reference_host_ns);
  const auto offset = static_cast<double>(clock.reference_device_ns - clock.reference_host_ns);
  return 1e-9 * (offset - since * 1e-6 * clock.drift_ppm);
}

/// Readings of one clock of a camera. One that was opened again, or whose clock jumped, has
/// several.
using ClockReadings = std::vector<std::vector<ClockSample>>;

std::optional<ClockFit> newest_clock(const ClockReadings& clocks) {
  return clocks.empty() ? std::nullopt : fit_clock(clocks.back(), {});
}

/// Cameras that say PTP holds their clocks, and whose clocks nevertheless differ by more than the
/// readings of both can explain (one in TAI and one in UTC, two masters, ...); and cameras whose
/// clocks PTP was asked to hold and does not, so that their offset and drift are estimated.
std::vector<LiveFault> ptp_faults(const std::vector<LiveCameraReport>& cameras) {
  std::vector<LiveFault> faults;
  const LiveCameraReport* first = nullptr;
  for (const LiveCameraReport& camera : cameras) {
    const auto status =
        setting_in(camera.settings, "ptp_status");  // absent when it was not asked for
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

/// A frame before the clocks are fitted.
struct Arrival {
  std::size_t camera = 0;
  std::int64_t index = 0;
  std::optional<std::size_t> clock;  ///< clock of the camera that stamped it, when that is sure
  std::optional<std::int64_t> counted_trigger;  ///< trigger answered by a camera without a clock
  std::optional<std::size_t> settled;           ///< number of the set it was given out in
  std::int64_t arrived_ns = 0;
  HostFrame frame;
  bool given_up = false;  ///< no partner came in time; it has no pixels
};

/// One camera of a capture that goes on.
struct Running {
  std::unique_ptr<CameraHost> host;
  FrameIdUnwrapper ids{FrameIdRange{}};
  std::int64_t base = 0;  ///< added to the unwrapped id; grows when ids start again
  std::int64_t newest = -1;
  std::optional<std::int64_t> newest_device_ns;
  std::int64_t last_frame_ns = 0;  ///< host time, for the watchdog only
  std::int64_t failed_ns = 0;      ///< 0: it runs
  std::int64_t retry_ns = 0;
  std::int64_t began_ns = 0;  ///< host time at which it was commanded to stream
  std::int64_t begin_ns = 0;  ///< not commanded to stream again before
  /// The first trigger since its last frame, and how many there were; of those of the session.
  std::int64_t asked_ns = 0;
  int unanswered = 0;
  bool started = false, fresh = true;
  double longest_gap_s = 0, longest_unnoticed_s = 0;
  /// Readings of the clock; a camera that was opened again, or whose clock jumped, has a new one.
  ClockReadings clocks;
  std::size_t clock_taken = 0;
  std::optional<ClockSample> last_reading;  ///< in the newest of `clocks`
  std::int64_t sure_from_ns = 0;  ///< frames that arrive before may be stamped by the clock before
  bool stamps_are_off = false;
  std::int64_t complete = 0;
  int opened_in_vain = 0;  ///< times since its last frame
  bool given_up = false;
  /// A frame and the trigger it answers, from which a camera without a clock is counted on.
  struct Counted {
    std::int64_t index = 0, trigger = 0;
  };
  std::optional<Counted> counted;
  int silent_triggers = 0;  ///< one after another
};

/// True where frames of the camera can be paired by device time.
bool has_clock(const Running& camera) {
  return camera.host->on_host_clock() || fit_clock(camera.host->clock_samples(), {}).has_value();
}

/// True where its frames are assigned by counting triggers.
bool never_had_clock(const Running& r) {
  return !r.host->on_host_clock() &&
         std::all_of(r.clocks.begin(), r.clocks.end(),
                     [](const auto& readings) { return readings.empty(); });
}

/// True where the camera's clock has been read since the frame came: then no jump that is seen
/// later touches it.
bool is_confirmed(const Running& r, const Arrival& a) {
  const bool reads = r.last_reading && !r.host->on_host_clock();
  return !reads || r.last_reading->host_before_ns > a.arrived_ns;
}

/// After a restart the device counts from the start again. Frames missed meanwhile are counted by
/// its clock, when that ran on and the camera has a rate of its own.
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

/// A camera that is named twice, once by its serial number: the second host waits in vain for it.
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

/// One capture from opening the cameras to its result.
class Session {
 public:
  Session(const CamerasFile& cameras, const LiveOptions& options)
      : file_(cameras), options_(options), epoch_ns_(now_ns()), last_progress_ns_(epoch_ns_) {
    for (const LiveCamera& camera : file_.cameras) {
      HostOptions host;
      host.program = options_.host_program;
      host.memory_limit_mb = options_.memory_limit_mb;
      host.opening_s = options_.opening_s;
      // A recording has no cable to be pulled: only a busy machine keeps its host silent.
      if (camera.address.backend == Backend::replay) host.silence_s = host.opening_s;
      host.slots = std::clamp<std::size_t>(std::lround(kRoom_s * file_.frame_rate_hz), 8, 64);
      // Room for every pixel format: pages that nobody writes cost nothing.
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
                      to_string(methods[i]), refused->camera, refused->what);
    }
  }

  /// Starts the host of every camera for the sync method, and waits until all are ready. Returns
  /// why the method cannot be used: a camera refuses it, does not open, or its clock is needed and
  /// cannot be read. Then no frames are expected.
  std::optional<LiveFault> open_all() {
    for (std::size_t c = 0; c < running_.size(); ++c) {
      CameraSettings settings = file_.cameras[c].settings;
      settings.trigger = trigger_of(report_.method);
      running_[c].host->set_settings(settings);
      running_[c].host->launch();
    }
    const std::int64_t until = now_ns() + nanoseconds(options_.opening_s);
    // By then a host has listed the network and named two devices of one serial number itself.
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
    return std::all_of(running_.begin(), running_.end(), is);
  }
  template <class Is>
  [[nodiscard]] bool any(Is is) const {
    return std::any_of(running_.begin(), running_.end(), is);
  }

  /// Waits for something from a camera host; not while a frame is there.
  void wait(double timeout_s) const {
    if (any([](const Running& r) { return r.host->has_frame(); })) return;
    std::vector<pollfd> descriptors;
    for (const Running& r : running_) descriptors.push_back({r.host->descriptor(), POLLIN, 0});
    ::poll(descriptors.data(), descriptors.size(), static_cast<int>(std::ceil(1e3 * timeout_s)));
  }

  /// Takes in what comes until `done`, at most for `most_s`.
  template <class Done>
  void take_in_until(double most_s, Done done) {
    const std::int64_t until = now_ns() + nanoseconds(most_s);
    while (now_ns() < until && !done()) {
      wait(0.02);
      take_in();
    }
  }

  /// Starts all streams and, where this process triggers, shows that every camera answers: the
  /// first frame of a stream is slow in many cameras, and is in no set.
  std::optional<LiveFault> begin_streams() {
    report_.paired_by = by_trigger()                               ? PairedBy::trigger
                        : all(has_clock) && !file_.pair_by_arrival ? PairedBy::time
                                                                   : PairedBy::arrival;
    for (Running& r : running_) start(r);
    // A trigger before the last camera streams would be half an instant.
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
        return LiveFault{name(c), fmt::format("it answers no {}", to_string(report_.method)),
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

  /// Waits for the final packet counts; frames that still come are outside the capture.
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
      // One of each camera at a time: the others wait in shared memory, which is bounded.
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
      // Some of the readings after every frame are enough for the fit.
      const bool soon = r.newest >= 0 && !clock.empty() &&
                        seconds(sample.host_before_ns - clock.back().host_before_ns) < kFitEvery_s;
      if (!soon) clock.push_back(sample);
      return;
    }
    add_fault(report_.faults,
              {name(c),
               fmt::format("its clock jumped by {:.3f} s; frames around that have no time", *jump),
               "let nothing set the camera's clock during a capture (PTP, other programs)"});
    const std::int64_t last_good_ns = before->host_before_ns;
    for (Arrival& a : arrivals_)
      if (a.camera == c && a.arrived_ns >= last_good_ns) a.clock.reset();
    r.sure_from_ns = now_ns() + nanoseconds(kAnswer_s);
    r.clocks.push_back({sample});
  }

  /// Until the clocks that pair frames by time were read after their frames.
  void await_readings() {
    const std::int64_t from = now_ns();  // not the frames that come later: there is always another
    take_in_until(kReadings_s, [&] {
      return by_trigger() || interrupted() ||
             std::all_of(arrivals_.begin(), arrivals_.end(), [&](const Arrival& a) {
               const Running& r = running_[a.camera];
               return a.settled || a.arrived_ns > from || r.host->fault() || is_confirmed(r, a);
             });
    });
  }

  /// A driver that says its times are the host's, and they are not.
  void check_stamp(std::size_t c, HostFrame& frame) {
    if (file_.cameras[c].address.backend != Backend::v4l2 || !frame.device_ns) return;
    const double off_s = seconds(*frame.device_ns - now_ns());
    if (std::abs(off_s) < kLargestDelay_s) return;
    frame.device_ns.reset();
    if (std::exchange(running_[c].stamps_are_off, true)) return;
    add_fault(report_.faults,
              {name(c), fmt::format("its time stamps are {:.0f} s off the host's clock", off_s),
               "unplug and plug the camera; until then its frames cannot be paired by time"});
  }

  void take_frame(std::size_t c, HostFrame frame) {
    Running& r = running_[c];
    const auto unwrapped = r.ids.unwrap(frame.id);
    if (!unwrapped)
      return add_fault(report_.faults,
                       {name(c), "a frame has an id that no camera gives",
                        "look for junk on the camera's network; else replace the camera"});
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
      add_fault(report_.faults,
                {name(c), "a frame is incomplete: " + frame.fault, remedy_for(*r.host)});
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

  /// Frames so old that no partner will come are only counted: memory stays bounded, whatever a
  /// camera does.
  void give_up_old_frames(std::size_t c) {
    std::optional<PairingResult> paired;
    if (!options_.on_set) {  // then the frames of all sets are wanted, and no others
      const auto kept = std::count_if(arrivals_.begin(), arrivals_.end(), [c](const Arrival& a) {
        return a.camera == c && !a.frame.pixels.empty();
      });
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

  /// The trigger that a frame answers, for a camera without a clock: the last one, when the
  /// camera counted as many frames as triggers were sent since a frame whose trigger is known. One
  /// frame fewer may be a late frame or an exposure left out: then nobody knows.
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

  /// Remedy for a camera that obeys and sends nothing, or nothing that outlives a receive buffer
  /// too small.
  std::string remedy_for_silence(const CameraHost& host) {
    if (host.identity().host_address.empty()) return "check cable and power of the camera";
    const std::string buffer = remedy_for_buffer(host);
    return fmt::format(
        "it obeys, but none of its pictures comes: {}let the firewall pass UDP from {} (`sudo nft "
        "list ruleset` shows it), and check cable and power",
        buffer.empty() ? "" : buffer + "; ", host.identity().address);
  }

  /// True where it streams and sends nothing, although its time came or it was triggered.
  bool is_silent(std::size_t c) const {
    const Running& r = running_[c];
    const bool live = file_.cameras[c].address.backend != Backend::replay;
    if (!live || !r.started || !r.host->ready() || r.host->fault()) return false;
    const std::int64_t now = now_ns();
    if (report_.method == SyncMethod::free_run)
      return seconds(now - r.last_frame_ns) > 2 / file_.frame_rate_hz + 0.5;
    // One trigger may be lost, and the answer to one be late.
    const double exposure_s = 1e-6 * r.host->wanted().exposure_us.value_or(0);
    return r.unanswered > 1 && seconds(now - r.asked_ns) > exposure_s + kLateAnswer_s &&
           seconds(now - trigger_ns_.back()) > exposure_s + kAnswer_s;
  }

  /// Notices a camera that is lost and brings it back, while the others go on.
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
      // One that still ends its stream begins a period later, in the same phase.
      r.host->started() ? void(r.begin_ns += nanoseconds(period_s())) : start(r);
    }
  }

  void open_again(std::size_t c) {
    Running& r = running_[c];
    // An operator who sees that a camera is lost has the time to mend it.
    r.given_up = !options_.demand && r.opened_in_vain == kOpenedInVain;
    if (r.given_up) {
      add_fault(report_.faults,
                {name(c),
                 fmt::format("it was opened {} times and gave no frame: {}", kOpenedInVain,
                             r.host->fault().value_or("it stays silent")),
                 r.host->fault() ? r.host->what_to_do() : remedy_for_silence(*r.host)});
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

  /// The newest exposure of each camera on the host's clock; nothing while one is not known.
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
    add_fault(report_.faults,
              {name(c),
               fmt::format("it exposes {:.1f} ms beside `{}`: its stream begins again in step",
                           1e3 * phase_s, name(0)),
               "use cameras with a trigger where that is too far apart"});
    r.host->stop();
    r.started = false;
    r.begin_ns = begin_again_ns(r.began_ns, phase_s, 1 / file_.frame_rate_hz,
                                now_ns() + nanoseconds(kStreamEnds_s));
  }

  void run_free() {
    std::int64_t look_at = options_.on_set ? 1 : options_.frames;
    while (!patience_ended() && seconds(now_ns() - streaming_since_ns_) < longest_s()) {
      double next_s = 0.02;  // until a camera that waits for it is to begin
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
      std::int64_t have = running_.front().complete;
      for (const Running& r : running_) have = std::min(have, r.complete);
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

  /// A set is sure when every camera has sent another whole frame since, or all are silent; and,
  /// where device times pair them, when every clock was read since: one that jumped is seen then.
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
      if (!std::all_of(set.frames.begin(), set.frames.end(), sure)) return;
      LiveSet live = set_of(set);
      for (const std::size_t i : set.frames) arrivals_[i].settled = given_out_;
      ++given_out_;
      options_.on_set(std::move(live), report_up_to_now(pairing));
    }
  }

  /// Develops the frames of a set and takes their pixels.
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
    // Exposed after the trigger was sent, and before the last frame was there.
    if (!live.spread_s && set.trigger)
      live.spread_bound_s = seconds(last_ns - trigger_ns_[static_cast<std::size_t>(*set.trigger)]);
    return live;
  }

  /// So that a bench with a camera that never pairs ends too.
  double longest_s() const {
    return 2 * options_.patience_s + 5 * (options_.frames + 2) / file_.frame_rate_hz;
  }

  /// Until the operator wants a set; false when none is wanted any more.
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

  /// It keeps its number, so that a late frame of it never passes for one of the next.
  void trigger_for_screen() {
    fire();
    --report_.triggers;
    ++report_.triggers_before;
    await_answers(kAnswer_s);
    settle_counts();
  }

  /// Free-running frames from before the operator asked.
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
    // Cameras count ticks of their own; under PTP they count ns and say so.
    if (device_ns)
      device_ns = std::llroundl(static_cast<long double>(*device_ns) * tick_hz(*r.host) / 1e9L);
    if (!actions_) actions_ = std::make_unique<ActionSender>(r.host->identity().host_address);
    if (!actions_->send(r.host->identity().address, device_ns))
      add_fault(report_.faults,
                {"", "an action command could not be sent", "check the network card"});
  }

  /// After a trigger that a camera without a clock did not answer in time, a late frame could pass
  /// for the next trigger's: it is counted again once it was silent for long.
  void settle_counts() {
    for (Running& r : running_) {
      const std::int64_t last = last_trigger();
      if (!never_had_clock(r) || !by_trigger() || r.host->fault()) continue;
      if (r.counted && r.counted->trigger == last) {
        r.silent_triggers = 0;
        continue;
      }
      if (++r.silent_triggers < 2) continue;
      // So long without a late frame: the next one answers the next trigger.
      const std::int64_t before = r.newest;
      take_in_until(kLateAnswer_s, [&] { return r.newest != before; });
      if (r.newest != before) continue;
      r.counted = Running::Counted{r.newest, last};
      r.silent_triggers = 0;
    }
  }

  /// Until every camera that is not lost has sent a frame, or the time for it is over, and then
  /// until none came for `quiet_s`.
  void await_answers(double within_s, double quiet_s = 0) {
    std::vector<std::int64_t> before;
    for (const Running& r : running_) before.push_back(r.newest);
    double exposure_s = 0;
    for (const Running& r : running_)
      exposure_s = std::max(exposure_s, 1e-6 * r.host->wanted().exposure_us.value_or(0));
    // A line is pulsed from outside whenever it likes.
    const double allowed =
        report_.method == SyncMethod::line_trigger ? options_.patience_s : exposure_s + within_s;
    const std::int64_t until = now_ns() + nanoseconds(allowed);
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
        clocks.back().push_back(fit_clock(readings, {}));
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
    PairingOptions options;
    options.cameras = running_.size();
    options.window_s = window_s();
    if (by_trigger()) options.triggers = report_.triggers;
    if (options_.demand && !by_trigger()) options.expected_frames = 0;  // as many as were looked at
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
    const auto wanted = static_cast<std::size_t>(options_.frames);
    const auto counted = by_trigger() ? every_frame(all) : frames_of_sets(all, pairing, wanted);
    for (const std::size_t i : counted) {
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
        add_fault(report_.faults,
                  {name(c), "no pulse came by the line: it sent no frame",
                   "see that pulses come by " + file_.cameras[c].settings.trigger_line});
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

  void tell(const LiveFault& fault) const {
    if (options_.on_camera) options_.on_camera(fault);
  }

  [[nodiscard]] std::string remedy_for(Unpaired why) const {
    switch (why) {
      case Unpaired::partner_missing:
        return by_trigger() ? "see why the other cameras have no frame of that trigger"
                            : "use a trigger, or cameras of one frame rate";
      case Unpaired::repeated_id:
        return "look for a switch that sends packets twice; else replace the camera";
      case Unpaired::no_time:
        return "let nothing set the camera's clock; or use software_trigger";
      case Unpaired::no_trigger:
        return "let nothing else trigger the camera, and lower frame_rate_hz";
      case Unpaired::no:
        break;
    }
    return {};
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
  bool ended_ = false;  ///< no reading will come any more
  LiveReport report_;
};

}  // namespace

void add_fault(std::vector<LiveFault>& faults, LiveFault fault) {
  const auto same = std::find_if(faults.begin(), faults.end(), [&](const LiveFault& f) {
    return f.camera == fault.camera && f.what == fault.what;
  });
  if (same == faults.end()) {
    faults.push_back(std::move(fault));
  } else {
    ++same->times;
  }
}

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

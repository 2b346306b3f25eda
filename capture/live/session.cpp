// SPDX-License-Identifier: Apache-2.0
#include "capture/live/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "capture/live/clocks.hpp"
#include "capture/live/opening.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr double kRetryEvery_s = 0.3;  ///< at first; half as much again after each time in vain
constexpr double kRetryAtMost_s = 2;
constexpr int kOpenedInVain = 10;   ///< then the camera is given up
constexpr int kTriggersBefore = 3;  ///< until every camera answers
constexpr std::size_t kMostBytesPerPixel = 3;
constexpr std::size_t kAroundFrame = 1 << 16;  ///< chunks, padding
constexpr double kRoom_s = 1.5;  ///< of frames that wait in shared memory while this process does
constexpr int kUsualPath_bytes = 1500;  ///< without jumbo frames
constexpr double kStopping_s = 2;
constexpr double kReadings_s = 1;            ///< twice the time between two readings of a clock
constexpr double kFitEvery_s = 0.4;          ///< readings of a clock that are kept
constexpr std::int64_t kPartnersWithin = 8;  ///< frames of the same camera
constexpr double kLargestDelay_s = 5;        ///< between exposure and arrival of a frame

/// Without a word where the camera's receive buffer holds a whole frame.
std::string remedy_for_buffer(const CameraHost& host) {
  std::int64_t room = 0, frame = 0;
  bool udp = false;
  for (const SettingReadBack& s : host.settings()) {
    if (s.name == "receive_buffer_bytes") room = std::stoll(s.value);
    if (s.name == "receive_buffer_of_a_frame_bytes") frame = std::stoll(s.value);
    if (s.name == "stream_socket") udp = s.value == "udp";
  }
  return udp && room < frame ? fmt::format("sudo sysctl -w net.core.rmem_max={}", 2 * frame) : "";
}

}  // namespace

Session::Session(const CamerasFile& cameras, const LiveOptions& options)
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

LiveResult Session::run() {
  open_with_fall_backs();
  streaming_since_ns_ = last_progress_ns_ = now_ns();
  report_.method == SyncMethod::free_run ? run_free() : run_triggered();
  stop_streams();
  return finish();
}

void Session::open_with_fall_backs() {
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
    auto refused = open_all(running_, file_, methods[i], options_.opening_s);
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

std::optional<LiveFault> Session::begin_streams() {
  const bool clocks = std::all_of(running_.begin(), running_.end(), has_clock);
  report_.paired_by = by_trigger()                       ? PairedBy::trigger
                      : clocks && !file_.pair_by_arrival ? PairedBy::time
                                                         : PairedBy::arrival;
  for (Running& r : running_) start(r);
  await_streams();
  if (!by_trigger()) return std::nullopt;
  for (int k = 0; k < kTriggersBefore; ++k) {
    fire();
    ++report_.triggers_before;
    const bool counted = std::any_of(running_.begin(), running_.end(),
                                     [](const Running& r) { return !has_clock(r); });
    await_answers(k + 1 < kTriggersBefore ? kAnswer_s : kLateAnswer_s, counted ? kAnswer_s : 0);
    const auto answers = [](const Running& r) { return r.newest >= 0 || r.host->fault(); };
    if (std::all_of(running_.begin(), running_.end(), answers)) break;
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

void Session::start(Running& r) {
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

void Session::await_streams() {
  const std::int64_t until = now_ns() + std::llround(1e9 * options_.opening_s);
  const auto streams = [](const Running& r) { return r.host->started() || r.host->fault(); };
  while (now_ns() < until && !std::all_of(running_.begin(), running_.end(), streams)) {
    wait(0.02);
    take_in();
  }
}

void Session::stop_streams() {
  const auto waits = [](const Running& r) { return r.host->has_frame(); };
  while (std::any_of(running_.begin(), running_.end(), waits)) take_in();
  for (Running& r : running_) r.host->stop();
  const std::int64_t until = now_ns() + std::llround(1e9 * kStopping_s);
  const auto stopped = [](const Running& r) { return !r.host->started() || r.host->fault(); };
  while (now_ns() < until && !std::all_of(running_.begin(), running_.end(), stopped)) {
    wait(0.02);
    for (Running& r : running_) r.host->pump();
  }
  for (std::size_t c = 0; c < running_.size(); ++c) take_readings(c);
}

void Session::take_in() {
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

void Session::take_readings(std::size_t c) {
  Running& r = running_[c];
  const auto& samples = r.host->clock_samples();
  for (; r.started && r.clock_taken < samples.size(); ++r.clock_taken)
    take_reading(c, samples[r.clock_taken]);
}

void Session::take_reading(std::size_t c, const ClockSample& sample) {
  Running& r = running_[c];
  std::vector<ClockSample>& clock = r.clocks.back();
  const auto before = std::exchange(r.last_reading, sample);
  const auto jump = before ? clock_jump_s(*before, sample) : std::nullopt;
  if (!jump) {
    // Of readings after every frame some are enough for the fit.
    const bool soon = r.newest >= 0 && !clock.empty() &&
                      seconds(sample.host_before_ns - clock.back().host_before_ns) < kFitEvery_s;
    if (!soon) clock.push_back(sample);
    return;
  }
  add_fault(
      report_.faults,
      {name(c), fmt::format("its clock jumped by {:.3f} s; frames around that have no time", *jump),
       "let nothing set the camera's clock during a capture (PTP, other programs)"});
  const std::int64_t last_good_ns = before->host_before_ns;
  for (Arrival& a : arrivals_)
    if (a.camera == c && a.arrived_ns >= last_good_ns) a.clock.reset();
  r.sure_from_ns = now_ns() + std::llround(1e9 * kAnswer_s);
  r.clocks.push_back({sample});
}

void Session::await_readings() {
  // Not those that come meanwhile: there is always a newer one.
  const std::int64_t from = now_ns(), until = from + std::llround(1e9 * kReadings_s);
  const auto confirmed = [&](const Arrival& a) {
    const Running& r = running_[a.camera];
    return a.settled || a.arrived_ns > from || r.host->fault() || is_confirmed(r, a);
  };
  while (!by_trigger() && now_ns() < until && !interrupted() &&
         !std::all_of(arrivals_.begin(), arrivals_.end(), confirmed)) {
    wait(0.02);
    take_in();
  }
}

void Session::check_stamp(std::size_t c, HostFrame& frame) {
  if (file_.cameras[c].address.backend != Backend::v4l2 || !frame.device_ns) return;
  const double off_s = seconds(*frame.device_ns - now_ns());
  if (std::abs(off_s) < kLargestDelay_s) return;
  frame.device_ns.reset();
  if (std::exchange(running_[c].stamps_are_off, true)) return;
  add_fault(report_.faults,
            {name(c), fmt::format("its time stamps are {:.0f} s off the host's clock", off_s),
             "unplug and plug the camera; until then its frames cannot be paired by time"});
}

void Session::take_frame(std::size_t c, HostFrame frame) {
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
  arrivals_.push_back({c, index, clock, counted, std::nullopt, r.last_frame_ns, std::move(frame)});
}

void Session::give_up_old_frames(std::size_t c) {
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

std::optional<std::int64_t> Session::count_trigger(Running& r, std::int64_t index) const {
  const std::int64_t last = last_trigger();
  if (!by_trigger() || last < 0 || !r.counted) return std::nullopt;
  if (index - r.counted->index != last - r.counted->trigger) return std::nullopt;
  r.counted = Running::Counted{index, last};
  return last;
}

std::string Session::remedy_for(const CameraHost& host) {
  if (std::string buffer = remedy_for_buffer(host); !buffer.empty()) return buffer;
  for (const SettingReadBack& s : host.settings())
    if (s.name == "packet_size_bytes" && std::stoll(s.value) > kUsualPath_bytes)
      return fmt::format(
          "packet_size_bytes = {}, where a switch or card carries no larger ones; else "
          "raise packet_delay_ns, or lower frame_rate_hz",
          kUsualPath_bytes);
  return "raise packet_delay_ns, or lower frame_rate_hz; check cable and switch";
}

/// Of a camera that obeys and sends nothing, or nothing that outlives a receive buffer too small.
std::string Session::remedy_for_silence(const CameraHost& host) {
  if (host.identity().host_address.empty()) return "check cable and power of the camera";
  const std::string buffer = remedy_for_buffer(host);
  return fmt::format(
      "it obeys, but none of its pictures comes: {}let the firewall pass UDP from {} (`sudo nft "
      "list ruleset` shows it), and check cable and power",
      buffer.empty() ? "" : buffer + "; ", host.identity().address);
}

bool Session::is_silent(std::size_t c) const {
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

void Session::look_after(std::size_t c) {
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
    r.host->started() ? void(r.begin_ns += std::llround(1e9 / file_.frame_rate_hz)) : start(r);
  }
}

void Session::open_again(std::size_t c) {
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
  const double wait_s = std::min(kRetryAtMost_s, kRetryEvery_s * std::pow(1.5, r.opened_in_vain++));
  r.retry_ns = now_ns() + std::llround(1e9 * wait_s);
  r.host->launch();
}

}  // namespace drape::capture

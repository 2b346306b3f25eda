// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/action_command.hpp"
#include "capture/live/live_capture.hpp"
#include "capture/live/opening.hpp"
#include "capture/live/phases.hpp"
#include "capture/live/running.hpp"

namespace drape::capture {

using Clock = std::chrono::steady_clock;

inline constexpr double kAnswer_s = 0.5;      ///< of a trigger, above the exposure
inline constexpr double kLateAnswer_s = 3.0;  ///< the same on a machine that is starved

inline std::int64_t now_ns() {
  return Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

inline double seconds(std::int64_t ns) {
  return 1e-9 * static_cast<double>(ns);
}

/// One capture from opening the cameras to its result; what capture_live() runs.
class Session {
 public:
  Session(const CamerasFile& cameras, const LiveOptions& options);

  LiveResult run();

 private:
  // ---- opening ------------------------------------------------------------------------------
  void open_with_fall_backs();

  /// Starts all streams and, where this process triggers, shows that every camera answers: the
  /// first frame of a stream is slow in many cameras, and is in no set.
  std::optional<LiveFault> begin_streams();

  void start(Running& r);

  /// A trigger before the last camera streams would be half an instant.
  void await_streams();

  /// Waits for the final packet counts; frames that still come are outside the capture.
  void stop_streams();

  // ---- taking in what the hosts say ---------------------------------------------------------
  void wait(double timeout_s) const { wait_for_hosts(running_, timeout_s); }

  void take_in();

  void take_readings(std::size_t c);

  void take_reading(std::size_t c, const ClockSample& sample);

  /// A driver that says its times are the host's, and they are not.
  void check_stamp(std::size_t c, HostFrame& frame);

  void take_frame(std::size_t c, HostFrame frame);

  /// The trigger that a frame answers, for a camera without a clock: the last one, when the
  /// camera counted as many frames as triggers were sent since a frame whose trigger is known. One
  /// frame fewer may be a late frame or an exposure left out: then nobody knows.
  std::optional<std::int64_t> count_trigger(Running& r, std::int64_t index) const;

  /// Whether it streams and sends nothing, although its time came or it was triggered.
  [[nodiscard]] bool is_silent(std::size_t c) const;

  static std::string remedy_for(const CameraHost& host);
  static std::string remedy_for_silence(const CameraHost& host);

  /// Notices a camera that is lost and brings it back, while the others go on.
  void look_after(std::size_t c);

  void open_again(std::size_t c);

  // ---- the sync methods ---------------------------------------------------------------------
  [[nodiscard]] bool patience_ended() const;

  void tell_progress(std::int64_t done);

  void keep_in_step();

  void begin_again(std::size_t c, double phase_s);

  void run_free();

  /// A set is sure when every camera has sent another whole frame since, or all are silent; and,
  /// where device times pair them, when every clock was read since: one that jumped is seen then.
  void give_out(const PairingResult& pairing, bool all);

  /// Develops the frames of a set and takes their pixels.
  LiveSet set_of(const PairedFrames& set);

  /// Frames so old that no partner will come are only counted: memory stays bounded, whatever a
  /// camera does.
  void give_up_old_frames(std::size_t c);

  [[nodiscard]] bool interrupted() const { return options_.ended && options_.ended(); }

  /// So that a bench with a camera that never pairs ends too.
  [[nodiscard]] double longest_s() const;

  /// Until the operator wants a set; false when none is wanted any more.
  bool await_demand();

  void set_light();

  /// A trigger whose frames are for a screen alone.
  void trigger_for_screen();

  [[nodiscard]] std::int64_t last_trigger() const {
    return static_cast<std::int64_t>(trigger_ns_.size()) - 1;
  }

  void tell(const LiveFault& fault) const {
    if (options_.on_camera) options_.on_camera(fault);
  }

  /// Free-running frames from before the operator asked.
  void forget_unsettled();

  void run_triggered();

  void fire();

  void act(const Running& r, std::optional<std::int64_t> host_ns);

  /// After a trigger that a camera without a clock did not answer in time, a late frame could pass
  /// for the next trigger's: it is counted again once it was silent for long.
  void settle_counts();

  /// Until every camera that is not lost has sent a frame, or the time for it is over, and then
  /// until none came for `quiet_s`.
  void await_answers(double within_s, double quiet_s = 0);

  /// Until the clocks that pair frames by time were read after their frames.
  void await_readings();

  // ---- what comes out -----------------------------------------------------------------------
  [[nodiscard]] std::optional<double> time_of(
      const Arrival& a, const std::vector<std::optional<ClockFit>>& clocks) const;

  [[nodiscard]] bool by_trigger() const;

  std::vector<FrameMark> marks() const;

  PairingResult pair(const std::vector<FrameMark>& frames) const;

  [[nodiscard]] double window_s() const;

  void add_cameras(LiveReport& report, const PairingResult& pairing) const;

  [[nodiscard]] LiveReport report_up_to_now(const PairingResult& pairing) const;

  LiveResult finish();

  [[nodiscard]] std::string remedy_for(Unpaired why) const;

  [[nodiscard]] const std::string& name(std::size_t camera) const;

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

}  // namespace drape::capture

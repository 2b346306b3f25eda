// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/device/camera.hpp"
#include "core/fields/records.hpp"
#include "core/files/files.hpp"

namespace drape::capture {

/// Creates an anonymous memory file of a fixed size, for SharedFrames.
[[nodiscard]] Descriptor memory_for_frames(std::size_t bytes);

/// Frames in memory shared by two processes: `slots` of `slot_bytes` each.
class SharedFrames {
 public:
  /// Maps the memory behind a descriptor.
  SharedFrames(Descriptor memory, std::size_t slots, std::size_t slot_bytes);
  ~SharedFrames();
  SharedFrames(const SharedFrames&) = delete;
  SharedFrames& operator=(const SharedFrames&) = delete;

  [[nodiscard]] std::span<std::uint8_t> slot(std::size_t index) const;
  [[nodiscard]] int descriptor() const { return memory_.get(); }

 private:
  Descriptor memory_;
  std::size_t slots_, slot_bytes_;
  std::uint8_t* at_ = nullptr;
};

/// Sends one message; false if the peer has closed.
bool send_text(int descriptor, std::string_view text);
enum class Received { message, nothing, closed };
/// Receives the next message within `timeout_ms`.
[[nodiscard]] Received receive_text(int descriptor, int timeout_ms, std::string& text);

template <class Message>
bool send(int descriptor, const Message& message) {
  return send_text(descriptor, one_line(value_of(message)));
}
/// Receives and parses a message; an invalid one closes the channel.
template <class Message>
[[nodiscard]] Received receive(int descriptor, int timeout_ms, Message& message) {
  std::string text;
  const Received got = receive_text(descriptor, timeout_ms, text);
  if (got != Received::message) return got;
  message = {};
  try {
    throw_if_any(
        faults_of_reading(Document(Syntax::json, json_value(text)), walk_through(message)));
  } catch (const Error&) {
    return Received::closed;
  }
  return got;
}

/// Message from the capture to a camera host. Comments name the kinds that use a field.
struct Order {
  enum class Kind { open, start, stop, trigger, light, free };
  Kind kind = Kind::open;
  std::optional<CameraAddress> address = {};    ///< open
  std::optional<CameraSettings> settings = {};  ///< open, light
  std::size_t slots = 0, slot_bytes = 0;        ///< open
  std::size_t slot = 0;                         ///< free
};
void fields(Fields& f, Order& order);

/// A frame that left the camera; if complete, its pixels are in a slot of the shared memory.
struct FrameNews : FrameHead {
  std::size_t slot = 0, bytes = 0;
};

/// Message from a camera host to the capture. Comments name the kinds that use a field.
struct News {
  enum class Kind { ready, started, stopped, frame, alive, light, error };
  Kind kind = Kind::ready;
  std::string what = {}, what_to_do = {};       ///< error; light: empty if accepted
  std::optional<CameraIdentity> identity = {};  ///< ready
  std::vector<SettingReadBack> settings = {};   ///< ready, light: values read back
  std::uint64_t first_id = 0, last_id = 0;      ///< ready
  bool on_host_clock = false;                   ///< ready
  std::vector<ClockSample> clock = {};          ///< ready, alive
  std::optional<CameraCounters> counters = {};  ///< frame, alive
  std::int64_t without_room = 0;                ///< frames dropped because no slot was free
  std::optional<FrameNews> frame = {};
};
void fields(Fields& f, News& news);

struct HostOptions {
  std::filesystem::path program;  ///< drape-camera-host
  std::size_t slots = 8;          ///< frames in transit at the same time
  std::size_t slot_bytes = 0;     ///< size of the largest frame
  int memory_limit_mb = 2048;
  double silence_s = 1.0;  ///< silence after which the host counts as hung
  /// The same limit until the camera streams: libraries, discovery and drivers need longer.
  double opening_s = 15.0;
};

/// A frame as received from the camera host.
struct HostFrame : FrameHead {
  std::vector<std::uint8_t> pixels;  ///< bytes as sent, in CameraHost::pixel_format()
};

/// One camera in a process of its own, as seen from the capture. launch() starts a new process and
/// ends an earlier one; pump() processes its messages. Never blocks. Never throws for a fault of
/// the camera; fault() reports it.
class CameraHost {
 public:
  CameraHost(CameraAddress address, CameraSettings settings, HostOptions options);
  ~CameraHost();
  CameraHost(const CameraHost&) = delete;
  CameraHost& operator=(const CameraHost&) = delete;

  void launch();
  void kill();
  void pump();
  void start() { command(Order::Kind::start); }  ///< the camera streams once started() is true
  void stop() { command(Order::Kind::stop); }
  void trigger() { command(Order::Kind::trigger); }
  void set_settings(const CameraSettings& settings) { settings_ = settings; }
  /// Requests the given exposure and gain while streaming; light_answer() reports the result.
  void set_light(const CameraSettings& wanted);
  struct LightAnswer {
    std::string refused, what_to_do;  ///< empty if accepted; settings() then has the values
  };
  [[nodiscard]] std::optional<LightAnswer> light_answer() {
    return std::exchange(light_answer_, std::nullopt);
  }

  /// Reason why the camera cannot continue: an error it reported, its process ended, or it hung.
  [[nodiscard]] const std::optional<std::string>& fault() const { return fault_; }
  [[nodiscard]] const std::string& what_to_do() const { return what_to_do_; }
  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] int descriptor() const { return control_.get(); }
  [[nodiscard]] pid_t process() const { return process_; }
  [[nodiscard]] int launches() const { return launches_; }

  [[nodiscard]] const CameraIdentity& identity() const { return identity_; }
  [[nodiscard]] const std::vector<SettingReadBack>& settings() const { return read_back_; }
  [[nodiscard]] const CameraSettings& wanted() const { return settings_; }
  [[nodiscard]] std::string pixel_format() const;
  [[nodiscard]] FrameIdRange frame_ids() const { return ids_; }
  [[nodiscard]] bool on_host_clock() const { return on_host_clock_; }
  [[nodiscard]] const std::vector<ClockSample>& clock_samples() const { return clock_; }
  [[nodiscard]] CameraCounters counters() const;
  [[nodiscard]] std::int64_t frames_without_room() const { return no_slot_; }
  [[nodiscard]] bool has_frame() const { return !frames_.empty(); }
  /// Takes the oldest waiting frame and copies its pixels, which frees its slot of the shared
  /// memory; at most as many frames wait as there are slots.
  [[nodiscard]] std::optional<HostFrame> next_frame();

 private:
  void command(Order::Kind what);
  void take(const News& news);
  void take_light(const News& news);
  void fail(std::string what, std::string what_to_do);

  CameraAddress address_;
  CameraSettings settings_;
  HostOptions options_;
  Descriptor control_;
  std::optional<SharedFrames> memory_;
  pid_t process_ = -1;
  int launches_ = 0;
  bool ready_ = false, started_ = false, on_host_clock_ = false;
  std::optional<std::string> fault_;
  std::string what_to_do_;
  std::chrono::steady_clock::time_point last_sign_;
  CameraIdentity identity_;
  std::vector<SettingReadBack> read_back_;
  FrameIdRange ids_;
  std::vector<ClockSample> clock_;
  CameraCounters counters_, counters_before_;
  std::int64_t no_slot_ = 0;
  std::deque<FrameNews> frames_;  ///< frames waiting in the shared memory
  CameraSettings light_wanted_;
  std::optional<LightAnswer> light_answer_;
};

/// Path of drape-camera-host in libexec/drapebench, next to the folder of the running program.
[[nodiscard]] std::filesystem::path camera_host_program();

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Order::Kind>[] = {
    "open", "start", "stop", "trigger", "light", "free"};
template <>
inline constexpr std::string_view drape::names_of<drape::capture::News::Kind>[] = {
    "ready", "started", "stopped", "frame", "alive", "light", "error"};

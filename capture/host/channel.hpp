// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/device/camera.hpp"
#include "core/fields/records.hpp"

namespace drape::capture {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
  ~Descriptor() { reset(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  Descriptor(Descriptor&& other) noexcept : descriptor_(other.descriptor_) {
    other.descriptor_ = -1;
  }
  Descriptor& operator=(Descriptor&& other) noexcept;
  void reset();
  [[nodiscard]] int get() const { return descriptor_; }

 private:
  int descriptor_;
};

/// Frames in memory shared by two processes: `slots` of `slot_bytes` each.
class SharedFrames {
 public:
  /// Creates an anonymous memory file.
  SharedFrames(std::size_t slots, std::size_t slot_bytes);
  /// Maps the memory behind an inherited descriptor.
  SharedFrames(Descriptor memory, std::size_t slots, std::size_t slot_bytes);
  ~SharedFrames();
  SharedFrames(const SharedFrames&) = delete;
  SharedFrames& operator=(const SharedFrames&) = delete;

  [[nodiscard]] std::span<std::uint8_t> slot(std::size_t index) const;
  [[nodiscard]] std::size_t slots() const { return slots_; }
  [[nodiscard]] int descriptor() const { return memory_.get(); }

 private:
  void map();
  Descriptor memory_;
  std::size_t slots_, slot_bytes_;
  std::uint8_t* at_ = nullptr;
};

/// Sends one message; false if the other side has closed.
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
struct FrameNews {
  std::uint64_t id = 0;
  std::optional<std::int64_t> device_ns;
  bool complete = false;
  std::string fault;
  std::size_t slot = 0, bytes = 0, stride_bytes = 0;
  int width_px = 0, height_px = 0;
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
  std::int64_t without_room = 0;                ///< frames dropped for want of a slot
  std::optional<FrameNews> frame = {};
};
void fields(Fields& f, News& news);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Order::Kind>[] = {
    "open", "start", "stop", "trigger", "light", "free"};
template <>
inline constexpr std::string_view drape::names_of<drape::capture::News::Kind>[] = {
    "ready", "started", "stopped", "frame", "alive", "light", "error"};

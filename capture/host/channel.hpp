// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "capture/device/camera.hpp"
#include "core/files/json_file.hpp"

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

/// Frames in memory that two processes map: `slots` of `slot_bytes` each.
class SharedFrames {
 public:
  /// A new anonymous memory file.
  SharedFrames(std::size_t slots, std::size_t slot_bytes);
  /// The one behind an inherited descriptor.
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

/// Sends one message; false when the other side is gone.
bool send_message(int descriptor, const Json& message);
enum class Received { message, nothing, closed };
/// The next message within `timeout_ms`.
[[nodiscard]] Received receive_message(int descriptor, int timeout_ms, Json& message);

// What camera and capture tell each other about a camera.
[[nodiscard]] Json json_of(const CameraAddress& address);
[[nodiscard]] Json json_of(const CameraSettings& settings);
[[nodiscard]] Json json_of(const CameraIdentity& identity);
[[nodiscard]] CameraAddress address_of(const Json& json);
[[nodiscard]] CameraSettings settings_of(const Json& json);
[[nodiscard]] CameraIdentity identity_of(const Json& json);

}  // namespace drape::capture

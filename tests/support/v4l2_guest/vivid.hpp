// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace drape::test {

/// A device file of vivid for injecting faults while a program under test runs; only in the guest.
class VividNode {
 public:
  /// Throws std::runtime_error if it cannot be opened.
  explicit VividNode(const std::string& file);
  ~VividNode();
  VividNode(const VividNode&) = delete;
  VividNode& operator=(const VividNode&) = delete;

  /// Sets the control with the driver's name for it, or presses it if it is a button.
  void set(const std::string& control, std::int32_t value = 1);
  [[nodiscard]] std::int32_t get(const std::string& control);
  /// Sets size and rate of the signal, for an output and the capture that shows it. At 1600 x 1200
  /// px a pixel clock of 36.25 MHz gives 14.9 frames/s.
  void set_signal(std::uint32_t width_px, std::uint32_t height_px, std::uint32_t pixel_clock_hz);
  /// Sets the format of an output, by default 8-bit grey; multi-planar nodes in one plane.
  void set_output_format(std::uint32_t width_px, std::uint32_t height_px,
                         std::uint32_t fourcc = 0x59455247);
  /// Shows the picture on an output during the life of this object. (Debian's 6.1 kernel refuses
  /// write() on outputs, so mapped buffers are used.)
  void show(std::span<const std::uint8_t> pixels);

 private:
  [[nodiscard]] std::uint32_t id_of(const std::string& control);
  void call(unsigned long request, void* argument, const std::string& doing);

  std::string file_;
  int descriptor_ = -1;
  bool multiplanar_ = false;
};

}  // namespace drape::test

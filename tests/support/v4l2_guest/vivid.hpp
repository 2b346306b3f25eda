// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace drape::test {

/// A device file of vivid, to play faults on it beside the program under test. Only in the guest.
class VividNode {
 public:
  /// Throws std::runtime_error when it cannot be opened.
  explicit VividNode(const std::string& file);
  ~VividNode();
  VividNode(const VividNode&) = delete;
  VividNode& operator=(const VividNode&) = delete;

  /// Sets the control of that name as the driver spells it, or presses it when it is a button.
  void set(const std::string& control, std::int32_t value = 1);
  [[nodiscard]] std::int32_t get(const std::string& control);
  /// Size and rate of the signal, on an output and on the capture that shows it. At 1600 x 1200 px
  /// a pixel clock of 36.25 MHz gives 14.9 frames/s.
  void set_signal(std::uint32_t width_px, std::uint32_t height_px, std::uint32_t pixel_clock_hz);
  /// Format of an output, 8-bit grey unless said otherwise; multi-planar nodes in one plane.
  void set_output_format(std::uint32_t width_px, std::uint32_t height_px,
                         std::uint32_t fourcc = 0x59455247);
  /// Shows the picture on an output as long as this object lives. (Debian's 6.1 kernel refuses
  /// write() on outputs, so it goes through mapped buffers.)
  void show(std::span<const std::uint8_t> pixels);

 private:
  [[nodiscard]] std::uint32_t id_of(const std::string& control);
  void call(unsigned long request, void* argument, const std::string& doing);

  std::string file_;
  int descriptor_ = -1;
  bool multiplanar_ = false;
};

}  // namespace drape::test

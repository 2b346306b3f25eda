// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/videodev2.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace drape::capture {

/// An open V4L2 device file.
class V4l2Device {
 public:
  /// is_open() says whether it could be opened; errno then why not.
  explicit V4l2Device(const std::string& file);
  ~V4l2Device();
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] bool call(unsigned long request, void* argument) const;
  /// Throws Error(device) where the call fails; `doing` begins its sentence.
  void require(unsigned long request, void* argument, const std::string& doing) const;

 private:
  std::string file_;
  int descriptor_ = -1;
};

[[nodiscard]] std::string text_of(const __u8* text);

/// The device files that capture by streaming, in the order of their names, each with what it is
/// able to do (device_caps filled in).
[[nodiscard]] std::vector<std::pair<std::string, v4l2_capability>> capture_files();

}  // namespace drape::capture

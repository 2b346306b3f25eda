// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace drape::test {

/// Debian's arv-fake-gv-camera-0.8, unmodified, on a loopback address of the private network. It
/// has no timestamp latch, no packet resend, no PTP and no actions, and was written independently
/// of this project.
class DebianCamera {
 public:
  /// Reason why it is not available, or nullopt.
  [[nodiscard]] static std::optional<std::string> cannot();

  DebianCamera(const std::string& address, const std::string& serial);
  ~DebianCamera();
  DebianCamera(const DebianCamera&) = delete;
  DebianCamera& operator=(const DebianCamera&) = delete;

  /// True if this Mono8 picture is one that the camera draws at 10 ms of exposure and gain 0: a
  /// diagonal ramp of 255 levels that moves by one level per frame (its source, arvfakecamera.c).
  [[nodiscard]] static bool drew(const std::vector<std::uint8_t>& pixels, int width_px);

  /// Stops it for some time, as an overloaded machine would. Returns at once.
  void starve(double seconds);
  /// Restarts it as in a power cycle.
  void switch_off_and_on();

 private:
  void switch_on();

  std::string address_, serial_;
  std::thread starved_;
  pid_t process_ = -1;
};

}  // namespace drape::test

#define DRAPE_REQUIRE_DEBIAN_CAMERA()                          \
  if (const auto cannot = drape::test::DebianCamera::cannot()) \
  GTEST_SKIP() << "Debian's GigE camera is not to be had: " << *cannot

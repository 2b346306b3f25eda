// SPDX-License-Identifier: Apache-2.0
#include "capture/device/v4l2_device.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <libv4l2.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "capture/device/camera.hpp"

namespace drape::capture {
namespace {

std::optional<v4l2_capability> capability_of(const std::string& file) {
  const V4l2Device device(file);
  v4l2_capability capability{};
  if (!device.is_open() || !device.call(VIDIOC_QUERYCAP, &capability)) return std::nullopt;
  const std::uint32_t able = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? capability.device_caps
                                 : capability.capabilities;
  constexpr std::uint32_t captures = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE;
  if ((able & captures) == 0 || (able & V4L2_CAP_STREAMING) == 0) return std::nullopt;
  capability.device_caps = able;
  return capability;
}

}  // namespace

V4l2Device::V4l2Device(const std::string& file) : file_(file) {
  descriptor_ = ::open(file.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) return;
  // libv4l2 would otherwise offer sizes and formats that it makes up itself.
  if (::v4l2_fd_open(descriptor_, V4L2_DISABLE_CONVERSION) >= 0) return;
  ::close(descriptor_);
  descriptor_ = -1;
}

V4l2Device::~V4l2Device() {
  if (descriptor_ >= 0) ::v4l2_close(descriptor_);
}

bool V4l2Device::call(unsigned long request, void* argument) const {
  int result = 0;
  do {
    result = ::v4l2_ioctl(descriptor_, request, argument);
  } while (result == -1 && errno == EINTR);
  return result == 0;
}

void V4l2Device::require(unsigned long request, void* argument, const std::string& doing) const {
  if (call(request, argument)) return;
  throw device_error(fmt::format("{} failed: {}", doing, std::strerror(errno)), file_,
                     "unplug and plug the camera, and close other programs that use it");
}

std::string text_of(const __u8* text) {
  return reinterpret_cast<const char*>(text);
}

std::vector<std::pair<std::string, v4l2_capability>> capture_files() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().starts_with("video")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<std::pair<std::string, v4l2_capability>> found;
  for (const std::string& file : files) {
    if (const auto capability = capability_of(file)) found.emplace_back(file, *capability);
  }
  return found;
}

}  // namespace drape::capture

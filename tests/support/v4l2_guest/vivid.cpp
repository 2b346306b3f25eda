// SPDX-License-Identifier: Apache-2.0
#include "tests/support/v4l2_guest/vivid.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace drape::test {
namespace {

constexpr std::uint32_t kBuffers = 2;  ///< the driver shows the last one as long as it remains open

/// Totals of lines and frame by the CVT standard.
v4l2_dv_timings slow_signal(std::uint32_t width_px, std::uint32_t height_px,
                            std::uint32_t pixel_clock_hz) {
  v4l2_dv_timings timings{};
  timings.type = V4L2_DV_BT_656_1120;
  v4l2_bt_timings& bt = timings.bt;
  bt.width = width_px;
  bt.height = height_px;
  bt.polarities = V4L2_DV_VSYNC_POS_POL;
  bt.hfrontporch = 40;
  bt.hsync = 160;
  bt.hbackporch = 200;
  bt.vfrontporch = 3;
  bt.vsync = 4;
  bt.vbackporch = 7;
  bt.pixelclock = pixel_clock_hz;
  bt.standards = V4L2_DV_BT_STD_CVT;
  return timings;
}

}  // namespace

VividNode::VividNode(const std::string& file) : file_(file) {
  descriptor_ = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
  if (descriptor_ < 0) throw std::runtime_error(file + ": " + std::strerror(errno));
  v4l2_capability capability{};
  call(VIDIOC_QUERYCAP, &capability, "asking what it can");
  multiplanar_ = (capability.device_caps & V4L2_CAP_VIDEO_OUTPUT_MPLANE) != 0;
}

VividNode::~VividNode() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void VividNode::call(unsigned long request, void* argument, const std::string& doing) {
  if (::ioctl(descriptor_, request, argument) != 0)
    throw std::runtime_error(file_ + ": " + doing + ": " + std::strerror(errno));
}

std::uint32_t VividNode::id_of(const std::string& control) {
  v4l2_queryctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (::ioctl(descriptor_, VIDIOC_QUERYCTRL, &query) == 0) {
    if (control == reinterpret_cast<const char*>(query.name)) return query.id;
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  throw std::runtime_error(file_ + " has no control `" + control + "`");
}

void VividNode::set(const std::string& control, std::int32_t value) {
  v4l2_control setting{id_of(control), value};
  call(VIDIOC_S_CTRL, &setting, control);
}

std::int32_t VividNode::get(const std::string& control) {
  v4l2_control setting{id_of(control), 0};
  call(VIDIOC_G_CTRL, &setting, control);
  return setting.value;
}

void VividNode::set_signal(std::uint32_t width_px, std::uint32_t height_px,
                           std::uint32_t pixel_clock_hz) {
  v4l2_dv_timings timings = slow_signal(width_px, height_px, pixel_clock_hz);
  call(VIDIOC_S_DV_TIMINGS, &timings, "setting the signal");
}

void VividNode::set_output_format(std::uint32_t width_px, std::uint32_t height_px,
                                  std::uint32_t fourcc) {
  v4l2_format format{};
  format.type = multiplanar_ ? V4L2_BUF_TYPE_VIDEO_OUTPUT_MPLANE : V4L2_BUF_TYPE_VIDEO_OUTPUT;
  call(VIDIOC_G_FMT, &format, "reading the format");
  const auto set = [&](auto& pix) {
    pix.width = width_px;
    pix.height = height_px;
    pix.pixelformat = fourcc;
    pix.field = V4L2_FIELD_NONE;
  };
  if (multiplanar_) {
    set(format.fmt.pix_mp);
    format.fmt.pix_mp.num_planes = 1;
    for (auto& plane : format.fmt.pix_mp.plane_fmt) plane.bytesperline = 0;
  } else {
    set(format.fmt.pix);
    format.fmt.pix.bytesperline = 0;
  }
  call(VIDIOC_S_FMT, &format, "setting the format");
  const bool taken = multiplanar_ ? format.fmt.pix_mp.pixelformat == fourcc &&
                                        format.fmt.pix_mp.width == width_px &&
                                        format.fmt.pix_mp.height == height_px
                                  : format.fmt.pix.pixelformat == fourcc &&
                                        format.fmt.pix.width == width_px &&
                                        format.fmt.pix.height == height_px;
  if (!taken) throw std::runtime_error(file_ + " takes another format or size of picture");
}

void VividNode::show(std::span<const std::uint8_t> pixels) {
  const std::uint32_t type =
      multiplanar_ ? V4L2_BUF_TYPE_VIDEO_OUTPUT_MPLANE : V4L2_BUF_TYPE_VIDEO_OUTPUT;
  const auto bytes = static_cast<std::uint32_t>(pixels.size());
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = type;
  request.memory = V4L2_MEMORY_MMAP;
  call(VIDIOC_REQBUFS, &request, "asking for buffers");
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer{};
    v4l2_plane plane[VIDEO_MAX_PLANES]{};
    buffer.index = i;
    buffer.type = type;
    buffer.memory = request.memory;
    if (multiplanar_) {
      buffer.m.planes = plane;
      buffer.length = 1;
    }
    call(VIDIOC_QUERYBUF, &buffer, "asking for a buffer");
    const std::uint32_t length = multiplanar_ ? plane[0].length : buffer.length;
    const std::uint32_t offset = multiplanar_ ? plane[0].m.mem_offset : buffer.m.offset;
    if (length < bytes) throw std::runtime_error(file_ + ": a buffer is too small");
    void* at = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor_, offset);
    if (at == MAP_FAILED) throw std::runtime_error(file_ + ": a buffer cannot be mapped");
    std::memcpy(at, pixels.data(), bytes);
    ::munmap(at, length);
    (multiplanar_ ? plane[0].bytesused : buffer.bytesused) = bytes;
    buffer.field = V4L2_FIELD_NONE;
    call(VIDIOC_QBUF, &buffer, "queueing a picture");
  }
  std::uint32_t start = type;
  call(VIDIOC_STREAMON, &start, "starting the output");
}

}  // namespace drape::test

// SPDX-License-Identifier: Apache-2.0
// USB and other V4L2 cameras: native pixel formats only, memory-mapped buffers.
#include <fmt/format.h>
#include <libv4l2.h>
#include <poll.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "capture/device/camera.hpp"
#include "capture/device/v4l2_device.hpp"
#include "capture/pixel/pixel_format.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr std::uint32_t kMappedBuffers = 8;
constexpr double kExposureUnit_us = 100.0;  // V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us

class V4l2Camera final : public CameraDevice {
 public:
  V4l2Camera(const std::string& file, const v4l2_capability& capability)
      : name_(text_of(capability.bus_info)), device_(file) {
    if ((capability.device_caps & V4L2_CAP_VIDEO_CAPTURE) == 0)
      type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    identity_ = {text_of(capability.driver), text_of(capability.card), "", name_, ""};
    if (!device_.is_open())
      throw device_error(fmt::format("{} cannot be opened: {}", file, std::strerror(errno)), name_,
                         "check the rights of the device file");
  }
  ~V4l2Camera() override { release(); }

  [[nodiscard]] CameraIdentity identity() const override { return identity_; }

  [[nodiscard]] std::vector<SettingReadBack> configure(const CameraSettings& s) override {
    stop();
    read_back_.clear();
    if (s.trigger != TriggerSource::free_run)
      throw device_error("a V4L2 camera has no trigger that can be set here", name_,
                         "choose the sync method free_run");
    set_format(s);
    set_rate(s);
    set_controls(s);
    return read_back_;
  }

  [[nodiscard]] std::vector<SettingReadBack> set_light(const CameraSettings& s) override {
    read_back_.clear();
    set_exposure_and_gain(s);
    return read_back_;
  }

  [[nodiscard]] FrameIdRange frame_ids() const override { return {0, 0xFFFFFFFF}; }
  [[nodiscard]] std::size_t frame_bytes() const override { return frame_bytes_; }

  void start() override {
    if (running_) return;
    v4l2_requestbuffers request{};
    request.count = kMappedBuffers;
    request.type = type_;
    request.memory = V4L2_MEMORY_MMAP;
    device_.require(VIDIOC_REQBUFS, &request, "asking for buffers");
    for (std::uint32_t i = 0; i < request.count; ++i) map(i);
    std::uint32_t type = type_;
    device_.require(VIDIOC_STREAMON, &type, "starting the stream");
    running_ = true;
  }

  void stop() override { release(); }
  void trigger() override {
    throw device_error("a V4L2 camera has no software trigger", name_, "choose free_run");
  }

  [[nodiscard]] std::optional<CameraFrame> next(double timeout_s) override {
    give_back();
    pollfd wait{device_.descriptor(), POLLIN, 0};
    if (!running_ || ::poll(&wait, 1, static_cast<int>(timeout_s * 1e3)) <= 0) return std::nullopt;
    if ((wait.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0)
      throw device_error("the stream broke off", name_, "plug the camera in again");
    Queued queued = a_buffer(0);
    if (!call_with(VIDIOC_DQBUF, queued)) {
      if (errno == EAGAIN) return std::nullopt;
      throw device_error(fmt::format("no frame can be fetched: {}", std::strerror(errno)), name_,
                         "plug the camera in again");
    }
    held_ = queued.buffer.index;
    return frame_of(queued);
  }

  [[nodiscard]] std::optional<ClockSample> read_clock() override { return std::nullopt; }
  [[nodiscard]] bool on_host_clock() const override { return true; }
  [[nodiscard]] CameraCounters counters() const override { return {}; }

 private:
  struct Mapped {
    void* at = nullptr;
    std::size_t bytes = 0;
  };

  void note(const std::string& setting, const std::string& value) {
    read_back_.push_back({setting, value});
  }

  [[nodiscard]] bool is_multiplanar() const { return type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

  /// A buffer with room for its planes.
  struct Queued {
    v4l2_buffer buffer{};
    v4l2_plane planes[VIDEO_MAX_PLANES]{};
  };

  [[nodiscard]] Queued a_buffer(std::uint32_t index) const {
    Queued queued;
    queued.buffer.type = type_;
    queued.buffer.memory = V4L2_MEMORY_MMAP;
    queued.buffer.index = index;
    return queued;
  }

  /// Points the buffer at its own planes, wherever it was copied to.
  bool call_with(unsigned long request, Queued& queued) const {
    if (is_multiplanar()) {
      queued.buffer.m.planes = queued.planes;
      queued.buffer.length = VIDEO_MAX_PLANES;
    }
    return device_.call(request, &queued.buffer);
  }

  void require_with(unsigned long request, Queued& queued, const std::string& doing) const {
    if (call_with(request, queued)) return;
    throw device_error(fmt::format("{} failed: {}", doing, std::strerror(errno)), name_,
                       "unplug and plug the camera, and close other programs that use it");
  }

  /// What was asked for, or the best for measuring of what the camera has.
  [[nodiscard]] const PixelFormat& chosen_format(const std::string& asked) const {
    const auto native = native_formats();
    std::string all;
    for (const PixelFormat& format : pixel_formats()) {
      if (std::find(native.begin(), native.end(), format.code) == native.end()) continue;
      const bool same = format.name == asked || (asked == "Mono8" && format.name == "GREY");
      if (asked.empty() || same) return format;
      all += (all.empty() ? "" : ", ") + std::string(format.name);
    }
    throw device_error(asked.empty()
                           ? "the camera has no pixel format that is understood here"
                           : fmt::format("the camera has no native pixel format {}", asked),
                       name_, all.empty() ? "use another camera" : "it has " + all);
  }

  void set_format(const CameraSettings& s) {
    format_ = &chosen_format(s.pixel_format);
    v4l2_format format{};
    format.type = type_;
    device_.require(VIDIOC_G_FMT, &format, "reading the format");
    const auto set = [&](auto& pix) {
      if (s.width_px) pix.width = static_cast<std::uint32_t>(*s.width_px);
      if (s.height_px) pix.height = static_cast<std::uint32_t>(*s.height_px);
      pix.pixelformat = format_->code;
      pix.field = V4L2_FIELD_NONE;
    };
    const auto take = [&](const auto& pix) {
      if (pix.pixelformat != format_->code)
        throw device_error(
            fmt::format("the camera did not take the pixel format {}", format_->name), name_,
            "give another pixel_format");
      width_px_ = static_cast<int>(pix.width);
      height_px_ = static_cast<int>(pix.height);
    };
    if (is_multiplanar()) {
      set(format.fmt.pix_mp);
      for (auto& plane : format.fmt.pix_mp.plane_fmt) plane.bytesperline = 0;
      device_.require(VIDIOC_S_FMT, &format, "setting the format");
      take(format.fmt.pix_mp);
      line_bytes_ = format.fmt.pix_mp.plane_fmt[0].bytesperline;
      frame_bytes_ = format.fmt.pix_mp.plane_fmt[0].sizeimage;
    } else {
      set(format.fmt.pix);
      format.fmt.pix.bytesperline = 0;  // the driver chooses, not the format before
      device_.require(VIDIOC_S_FMT, &format, "setting the format");
      take(format.fmt.pix);
      line_bytes_ = format.fmt.pix.bytesperline;
      frame_bytes_ = format.fmt.pix.sizeimage;
    }
    line_bytes_ = std::max(line_bytes_, static_cast<std::uint32_t>(format_->row_bytes(width_px_)));
    require_size("width_px", s.width_px, width_px_);
    require_size("height_px", s.height_px, height_px_);
    note("width_px", fmt::format("{}", width_px_));
    note("height_px", fmt::format("{}", height_px_));
    note("pixel_format", std::string(format_->name));
  }

  void require_size(const char* name, const std::optional<int>& asked, int got) const {
    if (asked.value_or(got) == got) return;
    throw device_error(fmt::format("the camera took {} {} instead of {}", name, got, *asked), name_,
                       "give a size the camera has: v4l2-ctl --list-formats-ext");
  }

  [[nodiscard]] std::vector<std::uint32_t> native_formats() const {
    std::vector<std::uint32_t> codes;
    v4l2_fmtdesc description{};
    description.type = type_;
    for (; device_.call(VIDIOC_ENUM_FMT, &description); ++description.index)
      if ((description.flags & V4L2_FMT_FLAG_EMULATED) == 0)
        codes.push_back(description.pixelformat);
    return codes;
  }

  void set_rate(const CameraSettings& s) {
    v4l2_streamparm rate{};
    rate.type = type_;
    if (!device_.call(VIDIOC_G_PARM, &rate)) return;
    if (s.frame_rate_hz) {
      rate.parm.capture.timeperframe = {1000,
                                        static_cast<__u32>(std::lround(*s.frame_rate_hz * 1000))};
      device_.require(VIDIOC_S_PARM, &rate, "setting the frame rate");
    }
    const auto& period = rate.parm.capture.timeperframe;
    if (period.numerator == 0) return;
    const double got = static_cast<double>(period.denominator) / period.numerator;
    if (s.frame_rate_hz) require_taken("frame_rate_hz", *s.frame_rate_hz, got, name_);
    note("frame_rate_hz", fmt::format("{:g}", got));
  }

  /// Automatics off first, then the values they held; a control the camera lacks is left out.
  void set_controls(const CameraSettings& s) {
    turn_off(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "ExposureAuto");
    turn_off(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "DynamicFrameRate");
    turn_off(V4L2_CID_AUTOGAIN, 0, "GainAuto");
    turn_off(V4L2_CID_AUTO_WHITE_BALANCE, 0, "BalanceWhiteAuto");
    turn_off(V4L2_CID_AUTOBRIGHTNESS, 0, "BrightnessAuto");
    turn_off(V4L2_CID_FOCUS_AUTO, 0, "FocusAuto");
    turn_off(V4L2_CID_BACKLIGHT_COMPENSATION, 0, "BacklightCompensation");
    set_exposure_and_gain(s);
    // 100 is a straight line (UVC 1.5, 4.2.2.3.7); a camera that cannot says what it does.
    v4l2_queryctrl gamma{};
    gamma.id = V4L2_CID_GAMMA;
    if (!device_.call(VIDIOC_QUERYCTRL, &gamma) ||
        (gamma.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0)
      return;
    v4l2_control control{V4L2_CID_GAMMA, std::clamp(100, gamma.minimum, gamma.maximum)};
    device_.require(VIDIOC_S_CTRL, &control, "setting gamma");
    device_.require(VIDIOC_G_CTRL, &control, "reading gamma");
    note("gamma_percent", fmt::format("{}", control.value));
  }

  void set_exposure_and_gain(const CameraSettings& s) {
    set_control(V4L2_CID_EXPOSURE_ABSOLUTE, s.exposure_us, kExposureUnit_us, "exposure_us");
    set_control(V4L2_CID_GAIN, s.gain_db, 1, "gain_camera_units");
  }

  /// Only EINVAL means that the camera has no such control.
  void turn_off(std::uint32_t id, int off, const char* name) {
    v4l2_control control{id, off};
    if (!device_.call(VIDIOC_S_CTRL, &control)) {
      if (errno == EINVAL) return;
      throw device_error(fmt::format("{} cannot be turned off: {}", name, std::strerror(errno)),
                         name_, "close other programs that use the camera, or use another one");
    }
    device_.require(VIDIOC_G_CTRL, &control, fmt::format("reading {}", name));
    if (control.value != off)
      throw device_error(fmt::format("{} cannot be turned off", name), name_,
                         "turn it off by hand");
    note(name, "Off");
  }

  /// A value that is not wanted is left to the camera, and read where it has one.
  void set_control(std::uint32_t id, const std::optional<double>& wanted, double unit,
                   const std::string& name) {
    v4l2_control control{id, static_cast<int>(std::lround(wanted.value_or(0) / unit))};
    if (wanted)
      device_.require(VIDIOC_S_CTRL, &control, fmt::format("setting {}", name));
    else if (!device_.call(VIDIOC_G_CTRL, &control))
      return;
    device_.require(VIDIOC_G_CTRL, &control, fmt::format("reading {}", name));
    if (wanted) require_taken(name, *wanted, control.value * unit, name_);
    note(name, fmt::format("{:g}", control.value * unit));
  }

  /// The first plane alone: it holds the grey of every format that is understood.
  void map(std::uint32_t index) {
    Queued queued = a_buffer(index);
    require_with(VIDIOC_QUERYBUF, queued, "asking for a buffer");
    const bool planes = is_multiplanar();
    const std::size_t bytes = planes ? queued.planes[0].length : queued.buffer.length;
    const auto offset = planes ? queued.planes[0].m.mem_offset : queued.buffer.m.offset;
    void* at = ::v4l2_mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, device_.descriptor(),
                           offset);
    if (at == MAP_FAILED)
      throw device_error("a buffer cannot be mapped", name_, "free some memory");
    mapped_.push_back({at, bytes});
    require_with(VIDIOC_QBUF, queued, "queueing a buffer");
  }

  [[nodiscard]] CameraFrame frame_of(const Queued& queued) const {
    const v4l2_buffer& buffer = queued.buffer;
    CameraFrame frame;
    frame.id = buffer.sequence;
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      frame.device_ns = std::int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 +
                        std::int64_t{buffer.timestamp.tv_usec} * 1000;
    frame.width_px = width_px_;
    frame.height_px = height_px_;
    frame.stride_bytes = line_bytes_;
    const std::size_t sent = is_multiplanar() ? queued.planes[0].bytesused : buffer.bytesused;
    frame.bytes = std::min({sent, mapped_[buffer.index].bytes, frame_bytes_});
    frame.pixels = static_cast<const std::uint8_t*>(mapped_[buffer.index].at);
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0) frame.fault = "the driver marked it as faulty";
    const std::size_t rows = std::size_t{line_bytes_} * static_cast<std::size_t>(height_px_);
    if (format_->lossy() ? frame.bytes == 0 : frame.bytes < rows) frame.fault = "it is short";
    frame.complete = frame.fault.empty();
    return frame;
  }

  void give_back() {
    if (!held_) return;
    Queued queued = a_buffer(*held_);
    if (!call_with(VIDIOC_QBUF, queued))
      throw device_error("a buffer cannot be queued again", name_, "plug the camera in again");
    held_.reset();
  }

  void release() {
    held_.reset();
    std::uint32_t type = type_;
    if (running_) static_cast<void>(device_.call(VIDIOC_STREAMOFF, &type));
    for (const Mapped& m : mapped_) ::v4l2_munmap(m.at, m.bytes);
    mapped_.clear();
    v4l2_requestbuffers none{};
    none.type = type_;
    none.memory = V4L2_MEMORY_MMAP;
    if (running_) static_cast<void>(device_.call(VIDIOC_REQBUFS, &none));
    running_ = false;
  }

  std::string name_;
  V4l2Device device_;
  CameraIdentity identity_;
  std::vector<SettingReadBack> read_back_;
  std::vector<Mapped> mapped_;
  std::optional<std::uint32_t> held_;
  const PixelFormat* format_ = nullptr;
  std::uint32_t type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  std::size_t frame_bytes_ = 0;
  int width_px_ = 0, height_px_ = 0;
  std::uint32_t line_bytes_ = 0;
  bool running_ = false;
};

}  // namespace

std::unique_ptr<CameraDevice> open_v4l2_camera(const CameraAddress& address) {
  std::string all;
  std::vector<std::pair<std::string, v4l2_capability>> matching;
  for (const auto& [file, capability] : capture_files()) {
    const std::string bus = text_of(capability.bus_info);
    all += (all.empty() ? "" : ", ") + bus;
    if (address.device == bus || address.device == file) matching.emplace_back(file, capability);
  }
  if (matching.size() != 1)
    throw device_error(
        matching.empty() ? "no such V4L2 camera" : "several V4L2 cameras have this bus path",
        address.device, "name one of: " + (all.empty() ? "none found" : all));
  return std::make_unique<V4l2Camera>(matching[0].first, matching[0].second);
}

std::vector<FoundDevice> find_v4l2_devices() {
  std::vector<FoundDevice> found;
  for (const auto& [file, capability] : capture_files()) {
    FoundDevice device;
    device.backend = Backend::v4l2;
    device.identity = {text_of(capability.driver), text_of(capability.card), "", file, ""};
    device.name = text_of(capability.bus_info);
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
// USB and other V4L2 cameras; native pixel formats only, memory-mapped buffers.
#include <fcntl.h>
#include <fmt/format.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "capture/device/camera.hpp"

namespace drape::capture {
namespace {

constexpr std::uint32_t kMappedBuffers = 8;
constexpr double kExposureUnit_us = 100.0;  // V4L2_CID_EXPOSURE_ABSOLUTE counts 100 us

constexpr struct {
  std::uint32_t id;
  int off;
  const char* name;
} kAutomatics[] = {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, "ExposureAuto"},
                   {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "DynamicFrameRate"},
                   {V4L2_CID_AUTOGAIN, 0, "GainAuto"},
                   {V4L2_CID_AUTO_WHITE_BALANCE, 0, "BalanceWhiteAuto"},
                   {V4L2_CID_AUTOBRIGHTNESS, 0, "BrightnessAuto"},
                   {V4L2_CID_FOCUS_AUTO, 0, "FocusAuto"},
                   {V4L2_CID_BACKLIGHT_COMPENSATION, 0, "BacklightCompensation"}};

std::string text_of(const __u8* text) {
  return reinterpret_cast<const char*>(text);
}

/// An open V4L2 device file.
class V4l2Device {
 public:
  /// Opens the file; is_open() tells whether that succeeded, errno why not.
  explicit V4l2Device(std::string file) : file_(std::move(file)) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (descriptor_ < 0) return;
    // libv4l2 would otherwise offer sizes and formats that it converts itself.
    if (::v4l2_fd_open(descriptor_, V4L2_DISABLE_CONVERSION) >= 0) return;
    ::close(descriptor_);
    descriptor_ = -1;
  }
  ~V4l2Device() {
    if (descriptor_ >= 0) ::v4l2_close(descriptor_);
  }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }
  [[nodiscard]] int descriptor() const { return descriptor_; }

  [[nodiscard]] bool call(unsigned long request, void* argument) const {
    int result = 0;
    do {
      result = ::v4l2_ioctl(descriptor_, request, argument);
    } while (result == -1 && errno == EINTR);
    return result == 0;
  }

  /// Throws Error(device) if the call fails; `doing` starts the message.
  void require(unsigned long request, void* argument, const std::string& doing) const {
    if (!call(request, argument)) refuse(doing);
  }
  [[noreturn]] void refuse(const std::string& doing) const {
    throw device_error(fmt::format("{} failed: {}", doing, std::strerror(errno)), file_,
                       "unplug and plug the camera, and close other programs that use it");
  }

 private:
  std::string file_;
  int descriptor_ = -1;
};

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

/// Device files that support streaming capture, sorted by name, each with its capabilities
/// (device_caps filled in).
std::vector<std::pair<std::string, v4l2_capability>> capture_files() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().starts_with("video")) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<std::pair<std::string, v4l2_capability>> found;
  for (const std::string& file : files) {
    if (const auto capability = capability_of(file)) found.emplace_back(file, *capability);
  }
  return found;
}

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
    if (s.trigger != TriggerSource::free_run)
      throw device_error("a V4L2 camera has no trigger that can be set here", name_,
                         "choose the sync method free_run");
    SettingsWriter writer(name_, s);
    set_format(s, writer);
    if (const auto rate = frame_rate()) writer.apply("frame_rate_hz", rate);
    for (const auto& [id, off, name] : kAutomatics) turn_off(id, off, name, writer);
    set_light(writer);
    set_gamma(writer);
    return std::move(writer.read_back);
  }

  [[nodiscard]] std::vector<SettingReadBack> set_light(const CameraSettings& s) override {
    SettingsWriter writer(name_, s);
    set_light(writer);
    return std::move(writer.read_back);
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

 private:
  struct Mapped {
    void* at = nullptr;
    std::size_t bytes = 0;
  };

  [[nodiscard]] bool is_multiplanar() const { return type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE; }

  /// A buffer with storage for its planes.
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

  /// Calls the ioctl with the buffer pointing at its own planes, unlike those of a copy.
  bool call_with(unsigned long request, Queued& queued) const {
    if (is_multiplanar()) {
      queued.buffer.m.planes = queued.planes;
      queued.buffer.length = VIDEO_MAX_PLANES;
    }
    return device_.call(request, &queued.buffer);
  }

  void require_with(unsigned long request, Queued& queued, const std::string& doing) const {
    if (!call_with(request, queued)) device_.refuse(doing);
  }

  void set_format(const CameraSettings& s, SettingsWriter& writer) {
    const std::string asked = s.pixel_format == "Mono8" ? "GREY" : s.pixel_format;
    format_ = find_pixel_format(choose_pixel_format(asked, native_formats(), name_));
    v4l2_format format{};
    format.type = type_;
    device_.require(VIDIOC_G_FMT, &format, "reading the format");
    const auto settle = [&](auto& pix, auto& plane) {
      if (s.width_px) pix.width = static_cast<std::uint32_t>(*s.width_px);
      if (s.height_px) pix.height = static_cast<std::uint32_t>(*s.height_px);
      pix.pixelformat = format_->code;
      pix.field = V4L2_FIELD_NONE;
      plane.bytesperline = 0;  // the driver selects it, not the last format
      device_.require(VIDIOC_S_FMT, &format, "setting the format");
      if (pix.pixelformat != format_->code)
        throw device_error(
            fmt::format("the camera did not take the pixel format {}", format_->name), name_,
            "give another pixel_format");
      width_px_ = static_cast<int>(pix.width);
      height_px_ = static_cast<int>(pix.height);
      line_bytes_ = plane.bytesperline;
      frame_bytes_ = plane.sizeimage;
    };
    if (is_multiplanar()) {
      for (auto& plane : format.fmt.pix_mp.plane_fmt) plane.bytesperline = 0;
      settle(format.fmt.pix_mp, format.fmt.pix_mp.plane_fmt[0]);
    } else {
      settle(format.fmt.pix, format.fmt.pix);
    }
    line_bytes_ = std::max(line_bytes_, static_cast<std::uint32_t>(format_->row_bytes(width_px_)));
    const auto as_set = [](double) {};
    writer.apply("width_px", SettingPort{as_set, [this] { return width_px_; }});
    writer.apply("height_px", SettingPort{as_set, [this] { return height_px_; }});
    writer.note("pixel_format", std::string(format_->name));
  }

  /// Names of the formats that are supported here and native to the camera.
  [[nodiscard]] std::vector<std::string> native_formats() const {
    std::vector<std::string> names;
    v4l2_fmtdesc description{};
    description.type = type_;
    for (; device_.call(VIDIOC_ENUM_FMT, &description); ++description.index)
      if (const PixelFormat* format = find_pixel_format(description.pixelformat);
          format != nullptr && (description.flags & V4L2_FMT_FLAG_EMULATED) == 0)
        names.emplace_back(format->name);
    return names;
  }

  [[nodiscard]] std::optional<SettingPort> frame_rate() const {
    v4l2_streamparm rate{};
    rate.type = type_;
    if (!device_.call(VIDIOC_G_PARM, &rate) || rate.parm.capture.timeperframe.numerator == 0)
      return std::nullopt;
    return SettingPort{
        [this](double hz) {
          v4l2_streamparm wanted{};
          wanted.type = type_;
          wanted.parm.capture.timeperframe = {1000, static_cast<__u32>(std::lround(hz * 1000))};
          device_.require(VIDIOC_S_PARM, &wanted, "setting the frame rate");
        },
        [this] {
          v4l2_streamparm now{};
          now.type = type_;
          device_.require(VIDIOC_G_PARM, &now, "reading the frame rate");
          const auto& period = now.parm.capture.timeperframe;
          return static_cast<double>(period.denominator) / period.numerator;
        }};
  }

  /// Makes a port for a control, nullopt if the camera lacks it; `unit` is the size of one count.
  [[nodiscard]] std::optional<SettingPort> control(std::uint32_t id, double unit,
                                                   const char* named) const {
    v4l2_control now{id, 0};
    if (!device_.call(VIDIOC_G_CTRL, &now)) return std::nullopt;
    return SettingPort{[this, id, unit, named](double value) {
                         v4l2_control wanted{id, static_cast<int>(std::lround(value / unit))};
                         device_.require(VIDIOC_S_CTRL, &wanted, fmt::format("setting {}", named));
                       },
                       [this, id, unit, named] {
                         v4l2_control got{id, 0};
                         device_.require(VIDIOC_G_CTRL, &got, fmt::format("reading {}", named));
                         return got.value * unit;
                       },
                       0, named};
  }

  void set_light(SettingsWriter& writer) const {
    writer.apply("exposure_us",
                 control(V4L2_CID_EXPOSURE_ABSOLUTE, kExposureUnit_us, "exposure_us"));
    writer.apply("gain_db", control(V4L2_CID_GAIN, 1, "gain_camera_units"));
  }

  void set_gamma(SettingsWriter& writer) const {
    // A gamma of 100 is linear (UVC 1.5, 4.2.2.3.7); a camera that cannot be set reports its value.
    v4l2_queryctrl gamma{};
    gamma.id = V4L2_CID_GAMMA;
    if (!device_.call(VIDIOC_QUERYCTRL, &gamma) ||
        (gamma.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY)) != 0)
      return;
    v4l2_control control{V4L2_CID_GAMMA, std::clamp(100, gamma.minimum, gamma.maximum)};
    device_.require(VIDIOC_S_CTRL, &control, "setting gamma");
    device_.require(VIDIOC_G_CTRL, &control, "reading gamma");
    writer.note("gamma_percent", fmt::format("{}", control.value));
  }

  /// Switches a control off; only EINVAL means that the camera does not have it.
  void turn_off(std::uint32_t id, int off, const char* name, SettingsWriter& writer) const {
    v4l2_control control{id, off};
    const bool taken = device_.call(VIDIOC_S_CTRL, &control);
    if (!taken && errno == EINVAL) return;
    const std::string why = taken ? "" : fmt::format(": {}", std::strerror(errno));
    if (taken) device_.require(VIDIOC_G_CTRL, &control, fmt::format("reading {}", name));
    if (!taken || control.value != off)
      throw device_error(fmt::format("{} cannot be turned off{}", name, why), name_,
                         "turn it off by hand, or close other programs that use the camera");
    writer.note(name, "Off");
  }

  /// Maps the first plane only: it holds the grey values of every supported format.
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
  std::vector<Mapped> mapped_;
  std::optional<std::uint32_t> held_;
  const PixelFormat* format_ = nullptr;
  std::uint32_t type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  std::size_t frame_bytes_ = 0;
  int width_px_ = 0, height_px_ = 0;
  std::uint32_t line_bytes_ = 0;
  bool running_ = false;
};

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
    device.identity = {text_of(capability.driver), text_of(capability.card), "", file, ""};
    device.name = text_of(capability.bus_info);
    found.push_back(std::move(device));
  }
  return found;
}

}  // namespace

extern const CameraDriver v4l2_driver{open_v4l2_camera, find_v4l2_devices};

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
// GigE Vision and USB3 Vision cameras through Aravis. Aravis keeps the control channel and gathers
// the packets; its counters are passed on but not trusted.
#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "capture/device/camera.hpp"
#include "capture/device/gige_discovery.hpp"
#include "capture/device/socket_filter.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr int kBuffers = 16;         // with 8, fast cameras find none free
constexpr int kHeartbeat_ms = 2000;  // above Aravis' own beat; a lost host frees the camera soon
constexpr std::int64_t kPtpWait_ns = 5'000'000'000;  // a slave finds its master in some seconds
constexpr std::int64_t kMono8 = 0x01080001;

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

std::string text_of(const char* text) {
  return text == nullptr ? "" : text;
}

/// GError of one call; turns into Error when the call failed.
class Failure {
 public:
  explicit Failure(std::string device) : device_(std::move(device)) {}
  ~Failure() { g_clear_error(&error_); }
  Failure(const Failure&) = delete;
  Failure& operator=(const Failure&) = delete;
  [[nodiscard]] GError** slot() {
    g_clear_error(&error_);
    return &error_;
  }
  [[nodiscard]] bool failed() const { return error_ != nullptr; }
  void require_none(const std::string& doing) const {
    if (error_ == nullptr) return;
    throw device_error(fmt::format("{} failed: {}", doing, error_->message), device_,
                       "check cable, power and network of the camera; `drape doctor` looks closer");
  }

 private:
  std::string device_;
  GError* error_ = nullptr;
};

std::string ip_of(GSocketAddress* address) {
  if (address == nullptr) return {};
  GInetAddress* inet = g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address));
  gchar* text = g_inet_address_to_string(inet);
  std::string result = text_of(text);
  g_free(text);
  return result;
}

class AravisCamera final : public CameraDevice {
 public:
  AravisCamera(Owned<ArvDevice> device, std::string name, const std::vector<int>& other_sockets)
      : name_(std::move(name)), device_(std::move(device)) {
    Failure failure(name_);
    camera_.reset(arv_camera_new_with_device(device_.get(), failure.slot()));
    failure.require_none("opening the camera");
    is_gige_ = ARV_IS_GV_DEVICE(device_.get());
    if (!is_gige_) return;
    if (!arv_gv_device_is_controller(ARV_GV_DEVICE(device_.get()))) {
      throw device_error("another program controls the camera", name_,
                         "end the other program, or wait until the camera's heartbeat ends it");
    }
    arv_gv_device_set_packet_size_adjustment(ARV_GV_DEVICE(device_.get()),
                                             ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    // The packet socket would pass by the source filter.
    arv_gv_device_set_stream_options(ARV_GV_DEVICE(device_.get()),
                                     ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    if (has("GevHeartbeatTimeout")) set_integer("GevHeartbeatTimeout", kHeartbeat_ms);
    identity_.address = ip_of(arv_gv_device_get_device_address(ARV_GV_DEVICE(device_.get())));
    identity_.host_address =
        ip_of(arv_gv_device_get_interface_address(ARV_GV_DEVICE(device_.get())));
    filter_new_sockets(other_sockets, kControlPort);
  }

  ~AravisCamera() override {
    try {
      stop();
    } catch (const Error&) {  // the camera is gone: nothing is left to stop
    }
  }

  [[nodiscard]] CameraIdentity identity() const override {
    CameraIdentity identity = identity_;
    identity.vendor = text_or_empty("DeviceVendorName");
    identity.model = text_or_empty("DeviceModelName");
    identity.serial = text_or_empty("DeviceSerialNumber");
    if (identity.serial.empty()) identity.serial = text_or_empty("DeviceID");
    return identity;
  }

  [[nodiscard]] std::vector<SettingReadBack> configure(const CameraSettings& s) override {
    stop();
    read_back_.clear();
    turn_automatics_off();
    set_choice("PixelFormat", s.pixel_format);
    set_region(s);
    if (is_gige_) set_packets(s);
    set_trigger_off();
    set_exposure_and_gain(s);
    set_rate(s);
    set_trigger(s);
    if (s.ptp) set_ptp();
    note("pixel_format", text_of(device_text("PixelFormat")));
    payload_ = static_cast<std::size_t>(integer("PayloadSize"));
    pixel_format_ = s.pixel_format;
    note("payload_bytes", fmt::format("{}", payload_));
    return read_back_;
  }

  [[nodiscard]] FrameIdRange frame_ids() const override {
    return is_gige_ ? FrameIdRange{1, 65535} : FrameIdRange{0, 0x7FFFFFFFFFFFFFFF};
  }
  [[nodiscard]] std::size_t frame_bytes() const override { return payload_; }

  void start() override {
    if (stream_) return;
    const std::vector<int> before = udp_sockets();
    Failure failure(name_);
    stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, failure.slot()));
    failure.require_none("opening the image stream");
    if (is_gige_) {
      // Patient with resends: the defaults give a frame up while its packets are on their way.
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", 4 << 20, "packet-resend",
                   ARV_GV_STREAM_PACKET_RESEND_ALWAYS, "packet-request-ratio", 1.0,
                   "frame-retention", 400'000U, nullptr);
      filter_new_sockets(before, static_cast<std::uint16_t>(integer("ArvGevSCSP")));
    }
    for (int i = 0; i < kBuffers; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload_));
    arv_camera_start_acquisition(camera_.get(), failure.slot());
    failure.require_none("starting the acquisition");
  }

  void stop() override {
    if (!stream_) return;
    give_back();
    Failure failure(name_);
    arv_camera_stop_acquisition(camera_.get(), failure.slot());
    keep_counters();
    stream_.reset();
  }

  void trigger() override {
    Failure failure(name_);
    arv_device_execute_command(device_.get(), "TriggerSoftware", failure.slot());
    failure.require_none("the software trigger");
  }

  [[nodiscard]] std::optional<CameraFrame> next(double timeout_s) override {
    give_back();
    if (!stream_) return std::nullopt;
    current_ = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_s * 1e6));
    if (current_ == nullptr) return std::nullopt;
    CameraFrame frame;
    const ArvBufferStatus status = arv_buffer_get_status(current_);
    frame.id = arv_buffer_get_frame_id(current_);
    frame.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(current_));
    if (status != ARV_BUFFER_STATUS_SUCCESS) {
      frame.fault = status == ARV_BUFFER_STATUS_MISSING_PACKETS ? "packets are missing"
                    : status == ARV_BUFFER_STATUS_TIMEOUT       ? "it did not arrive whole in time"
                                                                : "the stream gave it up";
      return frame;
    }
    take_image(frame);
    return frame;
  }

  [[nodiscard]] std::optional<ClockSample> read_clock() override {
    const bool legacy = has("GevTimestampControlLatch");
    if (!legacy && !has("TimestampLatch")) return std::nullopt;
    const std::int64_t tick_hz = !legacy || !has("GevTimestampTickFrequency")
                                     ? 1'000'000'000
                                     : integer("GevTimestampTickFrequency");
    ClockSample sample;
    Failure failure(name_);
    sample.host_before_ns = now_ns();
    arv_device_execute_command(
        device_.get(), legacy ? "GevTimestampControlLatch" : "TimestampLatch", failure.slot());
    sample.host_after_ns = now_ns();
    failure.require_none("reading the camera's clock");
    const std::int64_t ticks = integer(legacy ? "GevTimestampValue" : "TimestampLatchValue");
    sample.device_ns =
        tick_hz == 1'000'000'000
            ? ticks
            : std::llround(static_cast<double>(ticks) * 1e9 / static_cast<double>(tick_hz));
    return sample;
  }

  [[nodiscard]] bool on_host_clock() const override { return false; }

  [[nodiscard]] CameraCounters counters() const override {
    CameraCounters sum = counters_;
    if (stream_) add_counters(sum);
    return sum;
  }

 private:
  [[nodiscard]] bool has(const char* feature) const {
    GError* error = nullptr;
    const bool there = arv_device_is_feature_available(device_.get(), feature, &error) != 0;
    g_clear_error(&error);
    return there;
  }

  [[nodiscard]] const char* device_text(const char* feature) const {
    Failure failure(name_);
    const char* value = arv_device_get_string_feature_value(device_.get(), feature, failure.slot());
    failure.require_none(fmt::format("reading {}", feature));
    return value;
  }

  [[nodiscard]] std::string text_or_empty(const char* feature) const {
    return has(feature) ? text_of(device_text(feature)) : "";
  }

  [[nodiscard]] std::int64_t integer(const char* feature) const {
    Failure failure(name_);
    const std::int64_t value =
        arv_device_get_integer_feature_value(device_.get(), feature, failure.slot());
    failure.require_none(fmt::format("reading {}", feature));
    return value;
  }

  void set_integer(const char* feature, std::int64_t value) {
    Failure failure(name_);
    arv_device_set_integer_feature_value(device_.get(), feature, value, failure.slot());
    failure.require_none(fmt::format("setting {} to {}", feature, value));
  }

  void set_choice(const char* feature, const std::string& value) {
    Failure failure(name_);
    arv_device_set_string_feature_value(device_.get(), feature, value.c_str(), failure.slot());
    failure.require_none(fmt::format("setting {} to {}", feature, value));
    if (const std::string got = text_of(device_text(feature)); got != value)
      throw device_error(fmt::format("the camera took {} {} instead of {}", feature, got, value),
                         name_, "give a value the camera can take");
  }

  void note(const std::string& setting, const std::string& value) {
    read_back_.push_back({setting, value});
  }

  void turn_automatics_off() {
    for (const char* feature : {"ExposureAuto", "GainAuto", "BalanceWhiteAuto"}) {
      if (!has(feature)) continue;
      set_choice(feature, "Off");
      note(feature, "Off");
    }
  }

  /// Offsets to zero first, so that a larger size is never refused for the sake of the old offset.
  void set_region(const CameraSettings& s) {
    for (const char* offset : {"OffsetX", "OffsetY"})
      if (has(offset)) set_integer(offset, 0);
    set_and_note("Width", "width_px", s.width_px);
    set_and_note("Height", "height_px", s.height_px);
    if (has("OffsetX")) set_and_note("OffsetX", "offset_x_px", s.offset_x_px);
    if (has("OffsetY")) set_and_note("OffsetY", "offset_y_px", s.offset_y_px);
  }

  void set_packets(const CameraSettings& s) {
    set_and_note("GevSCPSPacketSize", "packet_size_bytes", s.packet_size_bytes);
    if (has("GevSCPD")) set_and_note("GevSCPD", "packet_delay_ticks", s.packet_delay_ns);
  }

  void set_and_note(const char* feature, const std::string& name, std::optional<int> value) {
    if (value) set_integer(feature, *value);
    const std::int64_t got = integer(feature);
    if (value && got != *value)
      throw device_error(fmt::format("the camera took {} {} instead of {}", name, got, *value),
                         name_, "give a value the camera can take");
    note(name, fmt::format("{}", got));
  }

  void set_trigger_off() {
    Failure failure(name_);
    arv_camera_clear_triggers(camera_.get(), failure.slot());
    failure.require_none("turning the triggers off");
    if (has("AcquisitionMode")) set_choice("AcquisitionMode", "Continuous");
  }

  void set_exposure_and_gain(const CameraSettings& s) {
    Failure failure(name_);
    if (s.exposure_us) {
      arv_camera_set_exposure_time(camera_.get(), *s.exposure_us, failure.slot());
      failure.require_none(fmt::format("setting the exposure to {} us", *s.exposure_us));
    }
    const double exposure_us = arv_camera_get_exposure_time(camera_.get(), failure.slot());
    if (!failure.failed()) note("exposure_us", fmt::format("{:g}", exposure_us));
    if (s.exposure_us) require_taken("exposure_us", *s.exposure_us, exposure_us, name_);
    if (s.gain_db) {
      arv_camera_set_gain(camera_.get(), *s.gain_db, failure.slot());
      failure.require_none(fmt::format("setting the gain to {} dB", *s.gain_db));
    }
    const double gain_db = arv_camera_get_gain(camera_.get(), failure.slot());
    if (!failure.failed()) note("gain_db", fmt::format("{:g}", gain_db));
    if (s.gain_db) require_taken("gain_db", *s.gain_db, gain_db, name_);
  }

  void set_rate(const CameraSettings& s) {
    Failure failure(name_);
    if (s.frame_rate_hz && s.trigger == TriggerSource::free_run) {
      arv_camera_set_frame_rate(camera_.get(), *s.frame_rate_hz, failure.slot());
      failure.require_none(fmt::format("setting the frame rate to {} Hz", *s.frame_rate_hz));
      const double got = arv_camera_get_frame_rate(camera_.get(), failure.slot());
      require_taken("frame_rate_hz", *s.frame_rate_hz, got, name_);
      note("frame_rate_hz", fmt::format("{:g}", got));
    }
  }

  void set_trigger(const CameraSettings& s) {
    if (s.trigger == TriggerSource::free_run) return note("trigger", "off");
    const std::string source = s.trigger == TriggerSource::software ? "Software"
                               : s.trigger == TriggerSource::action ? "Action1"
                                                                    : s.trigger_line;
    set_choice("TriggerSelector", "FrameStart");
    set_choice("TriggerMode", "On");
    set_choice("TriggerSource", source);
    note("trigger", source);
    if (s.trigger != TriggerSource::action) return;
    const ActionKeys keys;
    set_integer("ActionDeviceKey", keys.device_key);
    set_integer("ActionGroupKey", keys.group_key);
    set_integer("ActionGroupMask", keys.group_mask);
  }

  /// The names of the GenICam standard, and those of cameras from before it.
  struct PtpNames {
    const char *enable, *latch, *status, *offset_ns;
  };

  [[nodiscard]] std::optional<PtpNames> ptp_names() const {
    for (const PtpNames& names :
         {PtpNames{"PtpEnable", "PtpDataSetLatch", "PtpStatus", "PtpOffsetFromMaster"},
          {"GevIEEE1588", "GevIEEE1588DataSetLatch", "GevIEEE1588Status",
           "GevIEEE1588OffsetFromMaster"}})
      if (has(names.enable) && has(names.status)) return names;
    return std::nullopt;
  }

  /// What came of it is noted; without a master the camera goes on with the clock it has.
  void set_ptp() {
    const auto names = ptp_names();
    if (!names) return note("ptp_status", "not there");
    Failure failure(name_);
    arv_device_set_boolean_feature_value(device_.get(), names->enable, 1, failure.slot());
    failure.require_none("switching PTP on");
    std::string status;
    const std::int64_t until = now_ns() + kPtpWait_ns;
    do {
      if (!status.empty()) g_usleep(100'000);
      if (has(names->latch))
        arv_device_execute_command(device_.get(), names->latch, failure.slot());
      failure.require_none("reading PTP");
      status = text_of(device_text(names->status));
    } while (status != "Slave" && status != "Master" && now_ns() < until);
    note("ptp_status", status);
    if (has(names->offset_ns)) note("ptp_offset_ns", fmt::format("{}", integer(names->offset_ns)));
  }

  /// Filters the sockets that Aravis opened since `before`.
  void filter_new_sockets(const std::vector<int>& before, std::uint16_t port) {
    for (const int socket : udp_sockets()) {
      if (std::find(before.begin(), before.end(), socket) != before.end()) continue;
      if (!accept_only(socket, identity_.address, port))
        throw device_error("the kernel refused the source filter of a socket", name_,
                           "allow SO_ATTACH_FILTER for this process");
    }
  }

  void take_image(CameraFrame& frame) {
    std::size_t bytes = 0;
    frame.pixels = static_cast<const std::uint8_t*>(arv_buffer_get_data(current_, &bytes));
    frame.width_px = arv_buffer_get_image_width(current_);
    frame.height_px = arv_buffer_get_image_height(current_);
    frame.bytes =
        static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px);
    if (arv_buffer_get_image_pixel_format(current_) != kMono8) {
      frame.fault = "its pixel format is not Mono8";
    } else if (frame.width_px <= 0 || frame.height_px <= 0 || frame.bytes > bytes ||
               frame.bytes > payload_) {
      frame.fault = "its size is not the one that was set";
    } else {
      frame.complete = true;
    }
  }

  void give_back() {
    if (current_ == nullptr) return;
    arv_stream_push_buffer(stream_.get(), current_);
    current_ = nullptr;
  }

  void add_counters(CameraCounters& sum) const {
    const auto count = [&](const char* name) {
      return static_cast<std::int64_t>(arv_stream_get_info_uint64_by_name(stream_.get(), name));
    };
    if (is_gige_) {
      sum.packets_requested_again += count("n_resend_requests");
      sum.packets_resent += count("n_resent_packets");
      sum.packets_repeated += count("n_duplicated_packets");
    }
    sum.buffer_underruns += count("n_underruns");
  }

  void keep_counters() { add_counters(counters_); }

  std::string name_;
  Owned<ArvDevice> device_;
  Owned<ArvCamera> camera_;
  Owned<ArvStream> stream_;
  ArvBuffer* current_ = nullptr;
  bool is_gige_ = false;
  CameraIdentity identity_;
  std::vector<SettingReadBack> read_back_;
  std::size_t payload_ = 0;
  std::string pixel_format_;
  CameraCounters counters_;
};

/// Straight to a known address by a known network card: no discovery, so a lost camera is back
/// fast.
Owned<ArvDevice> open_at(const CameraAddress& address) {
  Owned<GInetAddress> host(g_inet_address_new_from_string(address.host_address.c_str()));
  Owned<GInetAddress> camera(g_inet_address_new_from_string(address.device.c_str()));
  if (!host || !camera) return nullptr;
  require_own_address(address.host_address, address.device);
  Failure failure(address.device);
  Owned<ArvDevice> device(arv_gv_device_new(host.get(), camera.get(), failure.slot()));
  failure.require_none("opening the camera");
  return device;
}

Owned<ArvDevice> open_by_name(const CameraAddress& address) {
  refuse_duplicate_serial(address.device);
  arv_update_device_list();
  std::vector<std::string> matching;
  std::string all;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const std::string id = text_of(arv_get_device_id(i));
    const std::string serial = text_of(arv_get_device_serial_nbr(i));
    const std::string ip = text_of(arv_get_device_address(i));
    all += fmt::format("{}{} ({})", all.empty() ? "" : ", ", serial, ip);
    if (address.device == serial || address.device == ip || address.device == id)
      matching.push_back(id);
  }
  if (matching.size() != 1) {
    throw device_error(
        matching.empty() ? "no such camera answers"
                         : fmt::format("{} cameras have this name", matching.size()),
        address.device,
        fmt::format("name one of: {}", all.empty() ? "none found; check power, cable "
                                                     "and network"
                                                   : all));
  }
  Failure failure(address.device);
  Owned<ArvDevice> device(arv_open_device(matching[0].c_str(), failure.slot()));
  failure.require_none("opening the camera");
  return device;
}

}  // namespace

std::unique_ptr<CameraDevice> open_aravis_camera(const CameraAddress& address) {
  const std::vector<int> other_sockets = udp_sockets();
  Owned<ArvDevice> device = address.host_address.empty() ? nullptr : open_at(address);
  if (!device) device = open_by_name(address);
  auto camera = std::make_unique<AravisCamera>(std::move(device), address.device, other_sockets);
  const std::string by = camera->identity().host_address;
  if (!address.host_address.empty() && by != address.host_address) {
    throw device_error(
        fmt::format("the camera is reached by {}, not by {}", by, address.host_address),
        address.device, "plug it into the right network card, or correct host_address");
  }
  return camera;
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
// GigE Vision and USB3 Vision cameras through Aravis. Aravis keeps the control channel and gathers
// the packets; its counters are passed on but not trusted.
#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "capture/device/aravis_features.hpp"
#include "capture/device/aravis_settings.hpp"
#include "capture/device/camera.hpp"
#include "capture/device/gige_discovery.hpp"
#include "capture/device/stream_socket.hpp"
#include "capture/pixel/pixel_format.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

constexpr int kBuffers = 16;         // with 8, fast cameras find none free
constexpr int kHeartbeat_ms = 2000;  // above Aravis' own beat; a lost host frees the camera soon
constexpr std::chrono::milliseconds kOtherHeartbeat{3500};  // above the standard's default, 3 s
constexpr std::size_t kFramesInSocket = 2;
constexpr int kSmallestPacket = 576;  // IPv4 guarantees it; where the camera does not say

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
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
    throw device_error(fmt::format("{} failed: {}", doing, clean_text(error_->message)), device_,
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
      : name_(std::move(name)), device_(std::move(device)), features_(device_.get(), name_) {
    Failure failure(name_);
    camera_.reset(arv_camera_new_with_device(device_.get(), failure.slot()));
    failure.require_none("opening the camera");
    is_gige_ = ARV_IS_GV_DEVICE(device_.get());
    if (!is_gige_) return;
    if (!takes_control()) {
      throw device_error("another program controls the camera", name_,
                         "end the other program, or wait until the camera's heartbeat ends it");
    }
    arv_gv_device_set_packet_size_adjustment(gige(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
    if (features_.can_write("GevHeartbeatTimeout"))
      features_.set_integer("GevHeartbeatTimeout", kHeartbeat_ms);
    identity_.address = ip_of(arv_gv_device_get_device_address(gige()));
    identity_.host_address = ip_of(arv_gv_device_get_interface_address(gige()));
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
    identity.vendor = features_.text_or_empty("DeviceVendorName");
    identity.model = features_.text_or_empty("DeviceModelName");
    identity.serial = features_.text_or_empty("DeviceSerialNumber");
    if (identity.serial.empty()) identity.serial = features_.text_or_empty("DeviceID");
    return identity;
  }

  [[nodiscard]] std::vector<SettingReadBack> configure(const CameraSettings& s) override {
    stop();
    std::vector<SettingReadBack> read_back = configure_aravis(features_, s, is_gige_);
    payload_ = static_cast<std::size_t>(features_.integer("PayloadSize"));
    for (const SettingReadBack& setting : read_back)
      if (setting.name == "pixel_format") format_ = find_pixel_format(setting.value);
    tick_hz_ = tick_rate_hz(features_, is_gige_);
    read_back.push_back({"payload_bytes", fmt::format("{}", payload_)});
    read_back.push_back(
        {"clock_tick_hz", tick_hz_ ? fmt::format("{:.0f}", *tick_hz_) : "not given"});
    if (is_gige_) choose_socket(read_back);
    return read_back;
  }

  [[nodiscard]] std::vector<SettingReadBack> set_light(const CameraSettings& s) override {
    return set_aravis_light(features_, s);
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
      // The library would set its socket's buffer with the first packet, when it is too late: the
      // buffer is set here and left alone there. Patient with resends: the defaults give a frame
      // up while its packets are in transit.
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", 0, "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS,
                   "packet-request-ratio", 1.0, "frame-retention", 400'000U, nullptr);
      const auto port = features_.integer_if("ArvGevSCSP").value_or(0);  // 0: any
      for (const int socket : filter_new_sockets(before, static_cast<std::uint16_t>(port)))
        set_receive_buffer(socket, wanted_buffer_);
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

  void trigger() override { features_.execute("TriggerSoftware"); }

  [[nodiscard]] std::optional<CameraFrame> next(double timeout_s) override {
    give_back();
    if (!stream_) return std::nullopt;
    // Its power was off for a moment, or no sign of life reached it: it belongs to nobody, answers,
    // and sends nothing.
    if (is_gige_ && !arv_gv_device_is_controller(gige()))
      throw device_error("the camera no longer belongs to this program", name_,
                         "check cable and power of the camera");
    current_ = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_s * 1e6));
    if (current_ == nullptr) return std::nullopt;
    CameraFrame frame;
    const ArvBufferStatus status = arv_buffer_get_status(current_);
    frame.id = arv_buffer_get_frame_id(current_);
    // Without a tick rate the library gives the time of arrival instead.
    if (tick_hz_) frame.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(current_));
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
    const bool legacy = features_.has("GevTimestampControlLatch");
    const char* latch = features_.first_of({"GevTimestampControlLatch", "TimestampLatch"});
    const char* value = legacy ? "GevTimestampValue" : "TimestampLatchValue";
    if (latch == nullptr || !features_.has(value) || !tick_hz_) return std::nullopt;
    ClockSample sample;
    sample.host_before_ns = now_ns();
    features_.execute(latch);
    sample.host_after_ns = now_ns();
    // TimestampLatchValue of SFNC counts ns, whatever the tick of the stream's stamps is.
    const std::int64_t ticks = features_.integer(value);
    sample.device_ns = legacy ? ns_of_ticks(ticks) : ticks;
    return sample;
  }

  [[nodiscard]] bool on_host_clock() const override { return false; }

  [[nodiscard]] CameraCounters counters() const override {
    CameraCounters sum = counters_;
    if (stream_) add_counters(sum);
    return sum;
  }

 private:
  [[nodiscard]] ArvGvDevice* gige() const { return ARV_GV_DEVICE(device_.get()); }

  /// A program that was killed controls the camera until its heartbeat is missed.
  [[nodiscard]] bool takes_control() const {
    const auto until = std::chrono::steady_clock::now() + kOtherHeartbeat;
    while (!arv_gv_device_is_controller(gige()) && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      arv_gv_device_take_control(gige(), nullptr);
    }
    return arv_gv_device_is_controller(gige());
  }

  [[nodiscard]] std::int64_t ns_of_ticks(std::int64_t ticks) const {
    if (*tick_hz_ == 1e9) return ticks;
    return std::llroundl(static_cast<long double>(ticks) * 1e9L / *tick_hz_);
  }

  /// A UDP socket with a filter of our own where its buffer holds a frame, else the packet socket,
  /// whose ring the library makes 32 MB large, where this process may open one.
  void choose_socket(std::vector<SettingReadBack>& read_back) {
    const auto packet = features_.integer_if("ArvGevSCPSPacketSize").value_or(kSmallestPacket);
    const std::size_t frame =
        receive_buffer_for(payload_, static_cast<std::size_t>(std::max<std::int64_t>(packet, 1)));
    wanted_buffer_ = kFramesInSocket * frame;
    const std::size_t reached = reachable_receive_buffer(wanted_buffer_);
    const bool ring = reached < frame && may_open_packet_socket();
    arv_gv_device_set_stream_options(
        gige(), ring ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
    read_back.push_back({"stream_socket", ring ? "packet" : "udp"});
    read_back.push_back({"receive_buffer_bytes", fmt::format("{}", reached)});
    read_back.push_back({"receive_buffer_of_a_frame_bytes", fmt::format("{}", frame)});
  }

  /// Filters the sockets that Aravis opened since `before`, and returns them.
  std::vector<int> filter_new_sockets(const std::vector<int>& before, std::uint16_t port) {
    std::vector<int> found;
    for (const int socket : udp_sockets()) {
      if (std::find(before.begin(), before.end(), socket) != before.end()) continue;
      if (!accept_only(socket, identity_.address, port))
        throw device_error("the kernel refused the source filter of a socket", name_,
                           "allow SO_ATTACH_FILTER for this process");
      found.push_back(socket);
    }
    return found;
  }

  void take_image(CameraFrame& frame) {
    const auto kind = arv_buffer_get_payload_type(current_);
    if (kind != ARV_BUFFER_PAYLOAD_TYPE_IMAGE &&
        kind != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) {
      frame.fault = "it is no image: switch chunk data off";
      return;
    }
    std::size_t bytes = 0;
    frame.pixels = static_cast<const std::uint8_t*>(arv_buffer_get_data(current_, &bytes));
    frame.width_px = arv_buffer_get_image_width(current_);
    frame.height_px = arv_buffer_get_image_height(current_);
    int pad_x = 0, pad_y = 0;
    arv_buffer_get_image_padding(current_, &pad_x, &pad_y);
    if (pad_x > 0)
      frame.stride_bytes = format_->row_bytes(frame.width_px) + static_cast<std::size_t>(pad_x);
    const auto* sent = find_pixel_format(arv_buffer_get_image_pixel_format(current_));
    frame.bytes = std::min(bytes, payload_);
    if (sent == nullptr || sent->packing != format_->packing || sent->bits != format_->bits ||
        sent->mosaic != format_->mosaic) {
      frame.fault = fmt::format("its pixel format is not {}", format_->name);
    } else if (frame.width_px <= 0 || frame.height_px <= 0 || frame.bytes < bytes_of(frame)) {
      frame.fault = "its size is not the one that was set";
    } else {
      frame.bytes = bytes_of(frame);
      frame.complete = true;
    }
  }

  [[nodiscard]] std::size_t bytes_of(const CameraFrame& frame) const {
    if (frame.stride_bytes > 0) return format_->frame_bytes(frame.stride_bytes, frame.height_px);
    // Packed formats run on from row to row.
    return (static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px) *
                format_->row_bytes(8) +
            7) /
           8;
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
  AravisFeatures features_;
  Owned<ArvCamera> camera_;
  Owned<ArvStream> stream_;
  ArvBuffer* current_ = nullptr;
  bool is_gige_ = false;
  CameraIdentity identity_;
  std::size_t payload_ = 0, wanted_buffer_ = 0;
  std::optional<double> tick_hz_;
  const PixelFormat* format_ = nullptr;
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

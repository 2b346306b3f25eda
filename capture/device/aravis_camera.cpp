// SPDX-License-Identifier: Apache-2.0
// GigE Vision and USB3 Vision cameras through Aravis. Aravis handles the control channel and
// assembles packets; its counters are reported but not relied on.
#include <arv.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <initializer_list>
#include <thread>
#include <type_traits>

#include "capture/device/camera.hpp"
#include "capture/device/gige_network.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kBuffers = 16;         // with 8, fast cameras run out of free buffers
constexpr int kHeartbeat_ms = 2000;  // above Aravis' own period; a lost host soon frees the camera
constexpr std::chrono::milliseconds kOtherHeartbeat{3500};  // above the standard's default of 3 s
constexpr auto kPtpWait = std::chrono::seconds(5);  // a PTP slave finds its master in some seconds
constexpr std::size_t kFramesInSocket = 2;
constexpr int kSmallestPacket = 576;  // guaranteed by IPv4; used if the camera reports none
constexpr double kUsualTick_hz = 1e9;

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Owned = std::unique_ptr<T, Unref>;

std::int64_t now_ns() {
  return Clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

/// Converts a camera's text to UTF-8 without control characters: invalid UTF-8 is read as Latin-1,
/// and characters that would control a terminal become `?`.
std::string clean_text(const std::string& text) {
  const char* const end = text.data() + text.size();
  const bool utf8 = g_utf8_validate(text.data(), static_cast<gssize>(text.size()), nullptr) != 0;
  std::string result;
  for (const char* at = text.data(); at < end;) {
    const gunichar one = utf8 ? g_utf8_get_char(at) : static_cast<unsigned char>(*at);
    at = utf8 ? g_utf8_next_char(at) : at + 1;
    char bytes[6];
    const auto size = static_cast<std::size_t>(g_unichar_to_utf8(one, bytes));
    result += g_unichar_iscntrl(one) != 0 ? "?" : std::string(bytes, size);
  }
  return result;
}

std::string text_of(const char* text) {
  return text == nullptr ? "" : clean_text(text);
}

constexpr const char* kLookCloser =
    "check cable, power and network of the camera; `drape doctor` looks closer";
constexpr const char* kGiveAnother =
    "give a value that the camera has; where it went silent, check its cable and power";

/// Calls Aravis with a GError argument and converts the error to Error(device).
template <class Call>
auto attempt(const std::string& doing, const std::string& device, const char* what_to_do,
             Call call) {
  GError* error = nullptr;
  const auto require_none = [&] {
    if (error == nullptr) return;
    const std::string why = clean_text(error->message);
    g_clear_error(&error);
    throw device_error(fmt::format("{} failed: {}", doing, why), device, what_to_do);
  };
  if constexpr (std::is_void_v<decltype(call(&error))>) {
    call(&error);
    require_none();
  } else {
    auto value = call(&error);
    require_none();
    return value;
  }
}

/// GenICam features of one camera by name. Cameras differ in features and their names; first_of()
/// finds the name that this one uses. A feature that the camera refuses throws Error(device) with
/// the camera's own message.
class AravisFeatures {
  /// Calls a function of Aravis on the feature.
  template <class Function, class... Values>
  auto ask(const std::string& doing, Function function, const char* feature,
           Values... values) const {
    return attempt(doing, name_, kGiveAnother,
                   [&](GError** error) { return function(device_, feature, values..., error); });
  }

 public:
  AravisFeatures(ArvDevice* device, std::string name) : device_(device), name_(std::move(name)) {}

  /// True if the feature exists and no other feature disables it.
  [[nodiscard]] bool has(const char* feature) const {
    return arv_device_is_feature_available(device_, feature, nullptr) != 0;
  }

  /// True if the feature exists and is writable now.
  [[nodiscard]] bool can_write(const char* feature) const {
    ArvGcNode* node = arv_device_get_feature(device_, feature);
    return ARV_IS_GC_FEATURE_NODE(node) && has(feature) &&
           arv_gc_feature_node_is_locked(ARV_GC_FEATURE_NODE(node), nullptr) == 0 &&
           arv_gc_feature_node_get_actual_access_mode(ARV_GC_FEATURE_NODE(node)) !=
               ARV_GC_ACCESS_MODE_RO;
  }

  /// The first of the features that the camera has; null if it has none.
  [[nodiscard]] const char* first_of(std::initializer_list<const char*> names) const {
    const auto found = std::ranges::find_if(names, [&](const char* n) { return has(n); });
    return found == names.end() ? nullptr : *found;
  }

  [[nodiscard]] std::vector<std::string> choices(const char* feature) const {
    guint count = 0;
    const char** names = arv_device_dup_available_enumeration_feature_values_as_strings(
        device_, feature, &count, nullptr);
    std::vector<std::string> result;
    for (guint i = 0; names != nullptr && i < count; ++i) result.push_back(clean_text(names[i]));
    g_free(names);
    return result;
  }

  [[nodiscard]] std::string text(const char* feature) const {
    return text_of(
        ask(fmt::format("reading {}", feature), arv_device_get_string_feature_value, feature));
  }

  [[nodiscard]] std::string text_or_empty(const char* feature) const {
    return has(feature) ? text(feature) : "";
  }

  [[nodiscard]] std::int64_t integer(const char* feature) const {
    return ask(fmt::format("reading {}", feature), arv_device_get_integer_feature_value, feature);
  }

  [[nodiscard]] std::optional<std::int64_t> integer_if(const char* feature) const {
    if (!has(feature)) return std::nullopt;
    try {
      return integer(feature);
    } catch (const Error&) {  // exists but cannot be read at present
      return std::nullopt;
    }
  }

  /// Reads a numeric feature, integer or floating point.
  [[nodiscard]] double number(const char* feature) const {
    if (is_integer(feature)) return static_cast<double>(integer(feature));
    return ask(fmt::format("reading {}", feature), arv_device_get_float_feature_value, feature);
  }

  void set_integer(const char* feature, std::int64_t value) const {
    ask(fmt::format("setting {} to {}", feature, value), arv_device_set_integer_feature_value,
        feature, value);
  }

  void set_number(const char* feature, double value) const {
    if (is_integer(feature)) return set_integer(feature, std::llround(value));
    ask(fmt::format("setting {} to {:g}", feature, value), arv_device_set_float_feature_value,
        feature, value);
  }

  void set_switch(const char* feature, bool on) const {
    ask(fmt::format("switching {} {}", feature, on ? "on" : "off"),
        arv_device_set_boolean_feature_value, feature, on ? 1 : 0);
  }

  /// Sets a feature and checks the value read back.
  void set_choice(const char* feature, const std::string& value) const {
    ask(fmt::format("setting {} to {}", feature, value), arv_device_set_string_feature_value,
        feature, value.c_str());
    if (const std::string got = text(feature); got != value)
      throw device_error(fmt::format("the camera took {} {} instead of {}", feature, got, value),
                         name_, "give a value the camera can take");
  }

  void execute(const char* feature) const {
    ask(fmt::format("executing {}", feature), arv_device_execute_command, feature);
  }

  [[nodiscard]] const std::string& device_name() const { return name_; }

 private:
  [[nodiscard]] bool is_integer(const char* feature) const {
    return ARV_IS_GC_INTEGER(arv_device_get_feature(device_, feature));
  }

  ArvDevice* device_;
  std::string name_;
};

/// Ticks per second of the camera's clock; nullopt if the camera does not state it.
std::optional<double> tick_rate_hz(const AravisFeatures& features, bool is_gige) {
  if (!is_gige) return kUsualTick_hz;  // USB3 Vision time stamps are in ns
  for (const char* feature : {"GevTimestampTickFrequency", "ArvGevTimestampTickFrequency"}) {
    const auto hz = features.integer_if(feature);
    if (hz && *hz > 0) return static_cast<double>(*hz);
  }
  return std::nullopt;
}

/// Feature names in the GenICam standard and in older cameras.
struct PtpNames {
  const char *enable, *latch, *status, *offset_ns;
};

/// Writes the settings in the order of their dependencies and reads all of them back.
class Configuration : private SettingsWriter {
 public:
  Configuration(const AravisFeatures& features, const CameraSettings& settings, bool is_gige)
      : SettingsWriter(features.device_name(), settings),
        features_(features),
        settings_(settings),
        is_gige_(is_gige) {}

  std::vector<SettingReadBack> run() {
    end_old_stream();
    turn_automatics_off();
    set_pixel_format();
    // Resets the offsets first: a larger size could otherwise be refused because of an old offset.
    for (const char* offset : {"OffsetX", "OffsetY"})
      if (features_.can_write(offset)) features_.set_integer(offset, 0);
    apply("width_px", port({"Width"}));
    apply("height_px", port({"Height"}));
    apply("offset_x_px", port({"OffsetX"}));
    apply("offset_y_px", port({"OffsetY"}));
    if (is_gige_) {
      apply("packet_size_bytes", port({"GevSCPSPacketSize"}));
      apply("packet_delay_ns", packet_delay());
    }
    set_triggers_off();
    set_light();
    if (settings_.trigger == TriggerSource::free_run) set_rate();
    set_trigger();
    if (settings_.ptp) set_ptp();
    return std::move(read_back);
  }

  std::vector<SettingReadBack> run_light() {
    set_light();
    return std::move(read_back);
  }

 private:
  /// Port of the first feature that this camera has; `unit` is the size of one of its counts.
  [[nodiscard]] std::optional<SettingPort> port(std::initializer_list<const char*> names,
                                                double unit = 1) const {
    const char* feature = features_.first_of(names);
    if (feature == nullptr) return std::nullopt;
    return SettingPort{
        [this, feature, unit](double value) { features_.set_number(feature, value / unit); },
        [this, feature, unit] { return features_.number(feature) * unit; }};
  }

  /// Stops a stream left by an earlier program; while streaming, the format is locked.
  void end_old_stream() const {
    for (const char* feature : {"AcquisitionStop", "AcquisitionAbort"}) {
      try {
        if (features_.has(feature)) features_.execute(feature);
      } catch (const Error&) {  // nothing is streaming
      }
    }
    if (features_.can_write("TLParamsLocked")) features_.set_integer("TLParamsLocked", 0);
  }

  void turn_automatics_off() {
    for (const char* feature :
         {"ExposureAuto", "GainAuto", "BalanceWhiteAuto", "BlackLevelAuto", "ExposureMode"}) {
      if (!features_.has(feature)) continue;
      const std::string off = std::string(feature) == "ExposureMode" ? "Timed" : "Off";
      const auto choices = features_.choices(feature);
      if (std::ranges::find(choices, off) == choices.end()) continue;
      if (features_.text(feature) != off) features_.set_choice(feature, off);
      note(feature, off);
    }
    // Switches off gamma and look-up tables, so that grey levels are linear, and extra data.
    for (const char* feature : {"GammaEnable", "GammaEnabled", "LUTEnable", "ChunkModeActive"}) {
      if (!features_.can_write(feature)) continue;
      features_.set_switch(feature, false);
      note(feature, "Off");
    }
    if (!features_.can_write("Gamma")) return;
    features_.set_number("Gamma", 1);
    const double gamma = features_.number("Gamma");
    if (std::abs(gamma - 1) > 0.02)
      throw device_error(fmt::format("the camera took Gamma {:g} instead of 1", gamma),
                         features_.device_name(), "use a camera whose gamma can be switched off");
    note("Gamma", "1");
  }

  void set_pixel_format() {
    const std::string chosen = choose_pixel_format(
        settings_.pixel_format, features_.choices("PixelFormat"), features_.device_name());
    if (features_.text("PixelFormat") != chosen) features_.set_choice("PixelFormat", chosen);
    note("pixel_format", chosen);
  }

  /// Packet delay. A camera counts it in ticks of its clock and may round to a coarser step of its
  /// own.
  [[nodiscard]] std::optional<SettingPort> packet_delay() const {
    const auto tick_hz = tick_rate_hz(features_, true);
    auto delay = tick_hz ? port({"GevSCPD", "ArvGevSCPD"}, 1e9 / *tick_hz) : std::nullopt;
    if (delay) delay->step = 1e9 / *tick_hz;
    return delay;
  }

  void set_triggers_off() {
    if (features_.can_write("TriggerMode")) {
      if (features_.can_write("TriggerSelector")) {
        for (const std::string& selector : features_.choices("TriggerSelector")) {
          features_.set_choice("TriggerSelector", selector);
          if (features_.can_write("TriggerMode")) features_.set_choice("TriggerMode", "Off");
        }
      } else {
        features_.set_choice("TriggerMode", "Off");
      }
    }
    if (features_.can_write("AcquisitionMode"))
      features_.set_choice("AcquisitionMode", "Continuous");
  }

  void set_light() {
    auto exposure = port({"ExposureTime", "ExposureTimeAbs"});
    if (!exposure) {
      const char* base = features_.first_of({"ExposureTimeBaseAbs", "ExposureTimeBase"});
      exposure = port({"ExposureTimeRaw"}, base == nullptr ? 1 : features_.number(base));
    }
    apply("exposure_us", exposure);
    auto gain = port({"Gain", "GainAbs"});
    if (!gain && !settings_.gain_db && (gain = port({"GainRaw"})))
      gain->named = "gain_camera_units";
    apply("gain_db", gain);
  }

  void set_rate() {
    for (const char* enable : {"AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"})
      if (features_.can_write(enable)) features_.set_switch(enable, true);
    if (features_.can_write("AcquisitionFrameRateAuto"))
      features_.set_choice("AcquisitionFrameRateAuto", "Off");
    apply("frame_rate_hz", port({"AcquisitionFrameRate", "AcquisitionFrameRateAbs", "FPS"}));
  }

  void set_trigger() {
    if (settings_.trigger == TriggerSource::free_run) return note("trigger", "off");
    const std::string source = settings_.trigger == TriggerSource::software ? "Software"
                               : settings_.trigger == TriggerSource::line   ? settings_.trigger_line
                                                                            : "Action1";
    const auto offered = features_.choices("TriggerSource");
    if (!features_.has("TriggerMode") || std::ranges::find(offered, source) == offered.end())
      throw device_error(
          fmt::format("the camera has no trigger source {}{}", source,
                      offered.empty() ? "" : fmt::format(", only {}", fmt::join(offered, ", "))),
          features_.device_name(),
          settings_.trigger == TriggerSource::line ? "correct trigger_line, or use another method"
                                                   : "use another sync method");
    if (features_.can_write("TriggerSelector"))
      features_.set_choice("TriggerSelector", "FrameStart");
    if (features_.can_write("TriggerSource")) features_.set_choice("TriggerSource", source);
    features_.set_choice("TriggerMode", "On");
    note("trigger", source);
    if (settings_.trigger != TriggerSource::action) return;
    const ActionKeys keys;
    if (features_.can_write("ActionSelector")) features_.set_integer("ActionSelector", 1);
    features_.set_integer("ActionDeviceKey", keys.device_key);
    features_.set_integer("ActionGroupKey", keys.group_key);
    features_.set_integer("ActionGroupMask", keys.group_mask);
  }

  [[nodiscard]] std::optional<PtpNames> ptp_names() const {
    for (const PtpNames& names :
         {PtpNames{"PtpEnable", "PtpDataSetLatch", "PtpStatus", "PtpOffsetFromMaster"},
          {"GevIEEE1588", "GevIEEE1588DataSetLatch", "GevIEEE1588Status",
           "GevIEEE1588OffsetFromMaster"}})
      if (features_.has(names.enable) && features_.has(names.status)) return names;
    return std::nullopt;
  }

  /// Reports the outcome of PTP; without a master the camera keeps its own clock.
  void set_ptp() {
    const auto names = ptp_names();
    if (!names) return note("ptp_status", "not there");
    features_.set_switch(names->enable, true);
    std::string status;
    const auto until = Clock::now() + kPtpWait;
    do {
      if (!status.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
      if (features_.has(names->latch)) features_.execute(names->latch);
      status = features_.text(names->status);
    } while (status != "Slave" && status != "Master" && Clock::now() < until);
    note("ptp_status", status);
    if (const auto offset = features_.integer_if(names->offset_ns))
      note("ptp_offset_ns", fmt::format("{}", *offset));
  }

  const AravisFeatures& features_;
  const CameraSettings& settings_;
  bool is_gige_;
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
    camera_.reset(attempt("opening the camera", name_, kLookCloser, [&](GError** error) {
      return arv_camera_new_with_device(device_.get(), error);
    }));
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
    } catch (const Error&) {  // the camera is gone; there is nothing to stop
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
    std::vector<SettingReadBack> read_back = Configuration(features_, s, is_gige_).run();
    payload_ = static_cast<std::size_t>(features_.integer("PayloadSize"));
    format_ = find_pixel_format(setting_in(read_back, "pixel_format").value_or(""));
    tick_hz_ = tick_rate_hz(features_, is_gige_);
    read_back.push_back({"payload_bytes", fmt::format("{}", payload_)});
    read_back.push_back(
        {"clock_tick_hz", tick_hz_ ? fmt::format("{:.0f}", *tick_hz_) : "not given"});
    if (is_gige_) choose_socket(read_back);
    return read_back;
  }

  [[nodiscard]] std::vector<SettingReadBack> set_light(const CameraSettings& s) override {
    return Configuration(features_, s, is_gige_).run_light();
  }

  [[nodiscard]] FrameIdRange frame_ids() const override {
    return is_gige_ ? FrameIdRange{1, 65535} : FrameIdRange{0, 0x7FFFFFFFFFFFFFFF};
  }
  [[nodiscard]] std::size_t frame_bytes() const override { return payload_; }

  void start() override {
    if (stream_) return;
    const std::vector<int> before = udp_sockets();
    stream_.reset(attempt("opening the image stream", name_, kLookCloser, [&](GError** error) {
      return arv_camera_create_stream(camera_.get(), nullptr, nullptr, error);
    }));
    if (is_gige_) {
      // Sets the socket buffer here, since Aravis would do so only at the first packet, too late,
      // and does not touch it there. Resend timeouts are longer than the defaults, which abandon a
      // frame while its packets are in transit.
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", 0, "packet-resend", ARV_GV_STREAM_PACKET_RESEND_ALWAYS,
                   "packet-request-ratio", 1.0, "frame-retention", 400'000U, nullptr);
      const auto port = features_.integer_if("ArvGevSCSP").value_or(0);  // 0 accepts any port
      for (const int socket : filter_new_sockets(before, static_cast<std::uint16_t>(port)))
        set_receive_buffer(socket, wanted_buffer_);
    }
    for (int i = 0; i < kBuffers; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new_allocate(payload_));
    attempt("starting the acquisition", name_, kLookCloser,
            [&](GError** error) { arv_camera_start_acquisition(camera_.get(), error); });
  }

  void stop() override {
    if (!stream_) return;
    give_back();
    arv_camera_stop_acquisition(camera_.get(), nullptr);
    add_counters(counters_);
    stream_.reset();
  }

  void trigger() override { features_.execute("TriggerSoftware"); }

  [[nodiscard]] std::optional<CameraFrame> next(double timeout_s) override {
    give_back();
    if (!stream_) return std::nullopt;
    // The camera lost power briefly or missed the heartbeat: it answers, but has no controller and
    // does not stream.
    if (is_gige_ && !arv_gv_device_is_controller(gige()))
      throw device_error("the camera no longer belongs to this program", name_,
                         "check cable and power of the camera");
    current_ = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_s * 1e6));
    if (current_ == nullptr) return std::nullopt;
    CameraFrame frame;
    const ArvBufferStatus status = arv_buffer_get_status(current_);
    frame.id = arv_buffer_get_frame_id(current_);
    // Without a tick rate, Aravis reports the time of arrival instead.
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
    // SFNC's TimestampLatchValue is in ns, whatever the tick of the stream's time stamps.
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

  /// Takes control of the camera. A killed program keeps it until its heartbeat times out.
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

  /// Selects the socket: UDP with our own filter if its buffer can hold a frame; else, if this
  /// process may open one, a packet socket, for which Aravis makes a ring of 32 MB.
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

  /// Adds a filter to the sockets that Aravis opened since `before`; returns these sockets.
  std::vector<int> filter_new_sockets(const std::vector<int>& before, std::uint16_t port) {
    std::vector<int> found;
    for (const int socket : udp_sockets()) {
      if (std::ranges::find(before, socket) != before.end()) continue;
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
    // Packed formats continue from row to row without padding.
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

/// Opens a known address through a known network card, without discovery, so that a lost camera is
/// back quickly.
Owned<ArvDevice> open_at(const CameraAddress& address) {
  Owned<GInetAddress> host(g_inet_address_new_from_string(address.host_address.c_str()));
  Owned<GInetAddress> camera(g_inet_address_new_from_string(address.device.c_str()));
  if (!host || !camera) return nullptr;
  require_own_address(address.host_address, address.device);
  return Owned<ArvDevice>(
      attempt("opening the camera", address.device, kLookCloser,
              [&](GError** error) { return arv_gv_device_new(host.get(), camera.get(), error); }));
}

/// Throws if several cameras answer with the same serial number.
void refuse_duplicate_serial(const std::string& device) {
  std::string addresses;
  int found = 0;
  for (const auto& [address, serial] : gige_cameras()) {
    if (serial != device) continue;
    addresses += (found++ == 0 ? "" : ", ") + address;
  }
  if (found < 2) return;
  throw device_error(fmt::format("{} cameras have this serial number: {}", found, addresses),
                     device, "name the camera by its IP address, with host_address");
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
  return Owned<ArvDevice>(
      attempt("opening the camera", address.device, kLookCloser,
              [&](GError** error) { return arv_open_device(matching[0].c_str(), error); }));
}

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

void add_hidden(std::vector<FoundDevice>& found) {
  for (const auto& answer : gige_cameras()) {
    const auto has_serial = [&](const FoundDevice& d) {
      return d.identity.serial == answer.second;
    };
    const auto is_listed = [&](const FoundDevice& d) {
      return has_serial(d) && d.identity.address == answer.first;
    };
    const auto twin = std::ranges::find_if(found, has_serial);
    if (twin == found.end() || std::ranges::any_of(found, is_listed)) continue;
    FoundDevice other = *twin;
    other.identity.address = answer.first;
    found.push_back(std::move(other));
  }
}

std::vector<FoundDevice> find_aravis_devices() {
  arv_update_device_list();
  std::vector<FoundDevice> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    FoundDevice device;
    device.identity.vendor = text_of(arv_get_device_vendor(i));
    device.identity.model = text_of(arv_get_device_model(i));
    device.identity.serial = text_of(arv_get_device_serial_nbr(i));
    device.identity.address = text_of(arv_get_device_address(i));
    device.name = device.identity.serial;
    found.push_back(std::move(device));
  }
  add_hidden(found);
  return found;
}

}  // namespace

extern const CameraDriver aravis_driver{open_aravis_camera, find_aravis_devices};

}  // namespace drape::capture

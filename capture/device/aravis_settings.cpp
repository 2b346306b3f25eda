// SPDX-License-Identifier: Apache-2.0
#include "capture/device/aravis_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "capture/pixel/pixel_format.hpp"
#include "core/error.hpp"

namespace drape::capture {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPtpWait = std::chrono::seconds(5);  // a slave finds its master in some seconds
constexpr double kUsualTick_hz = 1e9;

/// The names of the GenICam standard, and those of cameras from before it.
struct PtpNames {
  const char *enable, *latch, *status, *offset_ns;
};

class Configuration {
 public:
  Configuration(const AravisFeatures& features, const CameraSettings& settings, bool is_gige)
      : features_(features), settings_(settings), is_gige_(is_gige) {}

  std::vector<SettingReadBack> run() {
    end_old_stream();
    turn_automatics_off();
    set_pixel_format();
    set_region();
    if (is_gige_) set_packets();
    set_triggers_off();
    set_exposure();
    set_gain();
    set_rate();
    set_trigger();
    if (settings_.ptp) set_ptp();
    return std::move(read_back_);
  }

  std::vector<SettingReadBack> run_light() {
    set_exposure();
    set_gain();
    return std::move(read_back_);
  }

 private:
  void note(const std::string& setting, const std::string& value) {
    read_back_.push_back({setting, value});
  }

  /// A camera that still streams for a program that ended keeps its format locked.
  void end_old_stream() const {
    for (const char* feature : {"AcquisitionStop", "AcquisitionAbort"}) {
      try {
        if (features_.has(feature)) features_.execute(feature);
      } catch (const Error&) {  // nothing streams
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
      if (std::find(choices.begin(), choices.end(), off) == choices.end()) continue;
      if (features_.text(feature) != off) features_.set_choice(feature, off);
      note(feature, off);
    }
    // Grey levels that are proportional to the light, and nothing but the image in a frame.
    for (const char* feature : {"GammaEnable", "GammaEnabled", "LUTEnable", "ChunkModeActive"}) {
      if (!features_.can_write(feature)) continue;
      features_.set_switch(feature, false);
      note(feature, "Off");
    }
    if (!features_.can_write("Gamma")) return;
    features_.set_number("Gamma", 1);
    require_taken("Gamma", 1, features_.number("Gamma"), features_.device_name());
    note("Gamma", "1");
  }

  void set_pixel_format() {
    const auto offered = features_.choices("PixelFormat");
    std::string chosen = settings_.pixel_format;
    for (const PixelFormat& format : pixel_formats()) {
      if (!chosen.empty()) break;
      for (const std::string& name : offered)
        if (find_pixel_format(name) == &format) chosen = name;
    }
    if (chosen.empty() || find_pixel_format(chosen) == nullptr ||
        std::find(offered.begin(), offered.end(), chosen) == offered.end())
      throw device_error(chosen.empty() ? "the camera has no pixel format that is understood here"
                                        : fmt::format("the camera has no pixel format {}", chosen),
                         features_.device_name(),
                         fmt::format("it has {}", fmt::join(offered, ", ")));
    if (features_.text("PixelFormat") != chosen) features_.set_choice("PixelFormat", chosen);
    note("pixel_format", chosen);
  }

  /// Offsets to zero first, so that a larger size is never refused for the sake of the old offset.
  void set_region() {
    for (const char* offset : {"OffsetX", "OffsetY"})
      if (features_.can_write(offset)) features_.set_integer(offset, 0);
    set_and_note("Width", "width_px", settings_.width_px);
    set_and_note("Height", "height_px", settings_.height_px);
    if (features_.has("OffsetX")) set_and_note("OffsetX", "offset_x_px", settings_.offset_x_px);
    if (features_.has("OffsetY")) set_and_note("OffsetY", "offset_y_px", settings_.offset_y_px);
  }

  void set_packets() {
    set_and_note("GevSCPSPacketSize", "packet_size_bytes", settings_.packet_size_bytes);
    const char* feature = features_.first_of({"GevSCPD", "ArvGevSCPD"});
    if (feature == nullptr) return;
    const auto tick_hz = tick_rate_hz(features_, true);
    if (settings_.packet_delay_ns) {
      if (!tick_hz)
        throw device_error(
            "the camera does not say how long a tick of its clock is, so that the "
            "packet delay cannot be set",
            features_.device_name(), "leave packet_delay_ns out");
      features_.set_integer(feature, std::llround(*settings_.packet_delay_ns * *tick_hz / 1e9));
    }
    const auto ticks = features_.integer_if(feature);
    if (!ticks || !tick_hz) return;
    const double got_ns = static_cast<double>(*ticks) * 1e9 / *tick_hz;
    // Cameras round to steps of their own; a tick is the finest.
    if (settings_.packet_delay_ns &&
        std::abs(got_ns - *settings_.packet_delay_ns) > 0.5e9 / *tick_hz)
      require_taken("packet_delay_ns", *settings_.packet_delay_ns, got_ns, features_.device_name());
    note("packet_delay_ns", fmt::format("{:.0f}", got_ns));
  }

  void set_and_note(const char* feature, const std::string& name, std::optional<int> value) {
    const auto before = features_.integer_if(feature);
    if (value && before != *value) features_.set_integer(feature, *value);
    const std::int64_t got = features_.integer(feature);
    if (value && got != *value)
      throw device_error(fmt::format("the camera took {} {} instead of {}", name, got, *value),
                         features_.device_name(), "give a value the camera can take");
    note(name, fmt::format("{}", got));
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

  void set_exposure() {
    const char* feature = features_.first_of({"ExposureTime", "ExposureTimeAbs"});
    double unit_us = 1;
    if (feature == nullptr && features_.has("ExposureTimeRaw")) {
      feature = "ExposureTimeRaw";
      if (const char* base = features_.first_of({"ExposureTimeBaseAbs", "ExposureTimeBase"}))
        unit_us = features_.number(base);
    }
    if (feature == nullptr) {
      if (settings_.exposure_us)
        throw device_error("the camera has no exposure that can be set", features_.device_name(),
                           "leave exposure_us out and set it on the camera");
      return;
    }
    if (settings_.exposure_us) features_.set_number(feature, *settings_.exposure_us / unit_us);
    const double got_us = features_.number(feature) * unit_us;
    note("exposure_us", fmt::format("{:g}", got_us));
    if (settings_.exposure_us)
      require_taken("exposure_us", *settings_.exposure_us, got_us, features_.device_name());
  }

  void set_gain() {
    const char* feature = features_.first_of({"Gain", "GainAbs"});
    if (feature != nullptr) {
      if (settings_.gain_db) features_.set_number(feature, *settings_.gain_db);
      const double got_db = features_.number(feature);
      note("gain_db", fmt::format("{:g}", got_db));
      if (settings_.gain_db)
        require_taken("gain_db", *settings_.gain_db, got_db, features_.device_name());
      return;
    }
    if (settings_.gain_db)
      throw device_error("the camera does not count its gain in dB", features_.device_name(),
                         "leave gain_db out; the gain that it has is recorded");
    if (features_.has("GainRaw"))
      note("gain_camera_units", fmt::format("{:g}", features_.number("GainRaw")));
  }

  void set_rate() {
    if (settings_.trigger != TriggerSource::free_run) return;
    for (const char* enable : {"AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"})
      if (features_.can_write(enable)) features_.set_switch(enable, true);
    if (features_.can_write("AcquisitionFrameRateAuto"))
      features_.set_choice("AcquisitionFrameRateAuto", "Off");
    const char* feature =
        features_.first_of({"AcquisitionFrameRate", "AcquisitionFrameRateAbs", "FPS"});
    if (feature == nullptr) {
      if (settings_.frame_rate_hz)
        throw device_error("the camera has no frame rate that can be set", features_.device_name(),
                           "use the sync method software_trigger");
      return;
    }
    if (settings_.frame_rate_hz) features_.set_number(feature, *settings_.frame_rate_hz);
    const double got_hz = features_.number(feature);
    if (settings_.frame_rate_hz)
      require_taken("frame_rate_hz", *settings_.frame_rate_hz, got_hz, features_.device_name());
    note("frame_rate_hz", fmt::format("{:g}", got_hz));
  }

  [[nodiscard]] std::string trigger_source() const {
    if (settings_.trigger == TriggerSource::software) return "Software";
    if (settings_.trigger == TriggerSource::line) return settings_.trigger_line;
    return "Action1";
  }

  void set_trigger() {
    if (settings_.trigger == TriggerSource::free_run) return note("trigger", "off");
    const std::string source = trigger_source();
    const auto offered = features_.choices("TriggerSource");
    if (!features_.has("TriggerMode") ||
        std::find(offered.begin(), offered.end(), source) == offered.end())
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

  /// What came of it is noted; without a master the camera goes on with the clock it has.
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
  std::vector<SettingReadBack> read_back_;
};

}  // namespace

std::optional<double> tick_rate_hz(const AravisFeatures& features, bool is_gige) {
  if (!is_gige) return kUsualTick_hz;  // USB3 Vision stamps are ns
  for (const char* feature : {"GevTimestampTickFrequency", "ArvGevTimestampTickFrequency"}) {
    const auto hz = features.integer_if(feature);
    if (hz && *hz > 0) return static_cast<double>(*hz);
  }
  return std::nullopt;
}

std::vector<SettingReadBack> configure_aravis(const AravisFeatures& features,
                                              const CameraSettings& settings, bool is_gige) {
  return Configuration(features, settings, is_gige).run();
}

std::vector<SettingReadBack> set_aravis_light(const AravisFeatures& features,
                                              const CameraSettings& settings) {
  return Configuration(features, settings, false).run_light();
}

}  // namespace drape::capture

// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "capture/device/camera.hpp"

namespace drape::capture {
namespace {

/// A numeric setting, described once for cameras.toml, the camera host and every backend.
struct NumberSetting {
  const char *name, *meaning;  ///< name with unit, as in cameras.toml
  std::variant<std::optional<int> CameraSettings::*, std::optional<double> CameraSettings::*>
      member;
  bool own;              ///< true if set per camera in cameras.toml
  bool positive;         ///< true if it must exceed 0; else 0 is allowed
  double tolerance = 0;  ///< largest relative deviation from the request: step of a sensor
  /// Remedy if the camera cannot be set to the requested value.
  const char* otherwise = "leave it out; the value that the camera has is recorded";

  [[nodiscard]] std::optional<double> of(const CameraSettings& settings) const {
    return std::visit(
        [&](auto one) {
          const auto& value = settings.*one;
          return value ? std::optional<double>(*value) : std::nullopt;
        },
        member);
  }
};

/// Numeric settings in the order in which cameras take them.
constexpr NumberSetting kNumbers[] = {
    {"width_px", "width of the picture", &CameraSettings::width_px, false, true},
    {"height_px", "height of the pictures", &CameraSettings::height_px, false, true},
    {"offset_x_px", "first column of the sensor", &CameraSettings::offset_x_px, true, false},
    {"offset_y_px", "first row of the sensor", &CameraSettings::offset_y_px, true, false},
    {"packet_size_bytes", "size of the stream's packets", &CameraSettings::packet_size_bytes, true,
     false},
    {"packet_delay_ns", "pause between two packets", &CameraSettings::packet_delay_ns, true, false,
     0.02},
    {"exposure_us", "exposure time", &CameraSettings::exposure_us, true, true, 0.02},
    {"gain_db", "gain", &CameraSettings::gain_db, true, false, 0.02},
    {"frame_rate_hz", "frame rate", &CameraSettings::frame_rate_hz, false, true, 0.02,
     "use the sync method software_trigger"},
};

void number_fields(Fields& f, CameraSettings& settings, bool all) {
  for (const NumberSetting& one : kNumbers)
    if (all || one.own)
      std::visit(
          [&](auto member) {
            f.if_any({one.name, one.meaning, 1, one.positive ? above_zero : 0}, settings.*member);
          },
          one.member);
}

}  // namespace

std::optional<std::string> setting_in(std::span<const SettingReadBack> settings,
                                      std::string_view name) {
  const auto found = std::ranges::find(settings, name, &SettingReadBack::name);
  return found == settings.end() ? std::nullopt : std::optional(found->value);
}

std::string choose_pixel_format(const std::string& asked, const std::vector<std::string>& offered,
                                const std::string& device) {
  for (const PixelFormat& format : pixel_formats())
    for (const std::string& name : offered)
      if (find_pixel_format(name) == &format && (asked.empty() || name == asked)) return name;
  throw device_error(asked.empty() ? "the camera has no pixel format that is understood here"
                                   : fmt::format("the camera has no pixel format {}", asked),
                     device, fmt::format("it has {}", fmt::join(offered, ", ")));
}

void SettingsWriter::note(std::string name, std::string value) {
  read_back.push_back({std::move(name), std::move(value)});
}

void SettingsWriter::apply(std::string_view name, const std::optional<SettingPort>& port) {
  const NumberSetting& setting = *std::ranges::find(kNumbers, name, &NumberSetting::name);
  const std::optional<double> wanted = setting.of(wanted_);
  if (!port) {
    if (!wanted) return;
    throw device_error(fmt::format("the camera has no {} that can be set", name), device_,
                       setting.otherwise);
  }
  if (wanted && port->read() != *wanted) port->write(*wanted);
  const double got = port->read();
  const std::string noted = port->named.empty() ? std::string(name) : port->named;
  const bool whole = std::holds_alternative<std::optional<int> CameraSettings::*>(setting.member);
  note(noted, whole ? fmt::format("{:.0f}", got) : fmt::format("{:g}", got));
  if (!wanted ||
      std::abs(got - *wanted) <= std::max(setting.tolerance * std::abs(*wanted), 0.5 * port->step))
    return;
  throw device_error(fmt::format("the camera took {} {:g} instead of {:g}", noted, got, *wanted),
                     device_, "give a value the camera can take, within its range and steps");
}

Error device_error(std::string what_failed, const std::string& device, std::string what_to_do) {
  return Error(ErrorKind::device, std::move(what_failed), {.field = "device " + device},
               std::move(what_to_do));
}

void own_fields(Fields& f, CameraSettings& settings) {
  number_fields(f, settings, false);
  f.if_any({"pixel_format", "name of PFNC or V4L2; the best for measuring if left out"},
           settings.pixel_format);
  f.otherwise({"trigger_line", "trigger line"}, settings.trigger_line);
  f.limit(settings.pixel_format.empty() || find_pixel_format(settings.pixel_format) != nullptr,
          "pixel_format", settings.pixel_format + " frames cannot be recorded",
          "leave it out, so that the camera's best is taken");
}

void fields(Fields& f, CameraSettings& settings) {
  number_fields(f, settings, true);
  f.if_any({"pixel_format", "name of PFNC or V4L2"}, settings.pixel_format);
  f({"trigger", "what triggers an exposure"}, settings.trigger);
  f({"trigger_line", "trigger line"}, settings.trigger_line);
  f({"ptp", "true if PTP is on"}, settings.ptp);
}

void fields(Fields& f, CameraAddress& address) {
  f({"backend", "library of the camera"}, address.backend);
  f({"device", "serial number or IP address; bus path for V4L2; camera name for a recording"},
    address.device);
  f.if_any({"host_address", "IP address of the network card"}, address.host_address);
  f.if_any({"recording", "folder to play with the backend replay"}, address.recording);
}

void fields(Fields& f, CameraIdentity& identity) {
  f({"vendor", "manufacturer"}, identity.vendor);
  f({"model", "model"}, identity.model);
  f({"serial", "serial number"}, identity.serial);
  f({"address", "IP address or device file"}, identity.address);
  f({"host_address", "IP address of the network card"}, identity.host_address);
}

void fields(Fields& f, SettingReadBack& setting) {
  f({"name", "setting with its unit"}, setting.name);
  f({"value", "value in the camera"}, setting.value);
}

void fields(Fields& f, CameraCounters& counters) {
  f({"requested_again", "packets requested again"}, counters.packets_requested_again);
  f({"resent", "packets resent"}, counters.packets_resent);
  f({"repeated", "packets received twice"}, counters.packets_repeated);
}

void fields(Fields& f, ClockSample& sample) {
  f({"before", "host time, ns"}, sample.host_before_ns);
  f({"device", "device time, ns"}, sample.device_ns);
  f({"after", "host time, ns"}, sample.host_after_ns);
}

void fields(Fields& f, FoundDevice& device) {
  f({"backend", "library of the camera"}, device.backend);
  f({"device", "what cameras.toml names"}, device.name);
  fields(f, device.identity);
  f({"width_px", "width of its pictures"}, device.width_px);
  f({"height_px", "height of its pictures"}, device.height_px);
  f({"why_not_asked", "why the size is not known"}, device.why_not_asked);
}

void fields(Fields& f, FoundDevices& devices) {
  f({"cameras", "cameras that answer"}, devices.cameras);
}

}  // namespace drape::capture

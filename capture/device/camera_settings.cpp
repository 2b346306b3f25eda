// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "capture/device/camera.hpp"
#include "capture/pixel/pixel_format.hpp"

namespace drape::capture {
namespace {

constexpr const char* kLeaveOut = "leave it out; the value that the camera has is recorded";

constexpr NumberSetting kNumbers[] = {
    {"width_px", &CameraSettings::width_px, true, 0, kLeaveOut},
    {"height_px", &CameraSettings::height_px, true, 0, kLeaveOut},
    {"offset_x_px", &CameraSettings::offset_x_px, false, 0, kLeaveOut},
    {"offset_y_px", &CameraSettings::offset_y_px, false, 0, kLeaveOut},
    {"packet_size_bytes", &CameraSettings::packet_size_bytes, false, 0, kLeaveOut},
    {"packet_delay_ns", &CameraSettings::packet_delay_ns, false, 0.02, kLeaveOut},
    {"exposure_us", &CameraSettings::exposure_us, true, 0.02, kLeaveOut},
    {"gain_db", &CameraSettings::gain_db, false, 0.02, kLeaveOut},
    {"frame_rate_hz", &CameraSettings::frame_rate_hz, true, 0.02,
     "use the sync method software_trigger"},
};

}  // namespace

std::optional<double> NumberSetting::of(const CameraSettings& settings) const {
  return std::visit(
      [&](auto one) {
        const auto& value = settings.*one;
        return value ? std::optional<double>(*value) : std::nullopt;
      },
      member);
}

std::span<const NumberSetting> number_settings() {
  return kNumbers;
}

std::optional<std::string> value_of(std::span<const SettingReadBack> settings,
                                    std::string_view name) {
  const auto found = std::find_if(settings.begin(), settings.end(),
                                  [&](const SettingReadBack& one) { return one.name == name; });
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
  const NumberSetting& setting =
      *std::find_if(std::begin(kNumbers), std::end(kNumbers),
                    [&](const NumberSetting& one) { return one.name == name; });
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

}  // namespace drape::capture

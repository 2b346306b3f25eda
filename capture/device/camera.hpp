// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "capture/pairing/clock_fit.hpp"
#include "capture/pairing/frame_id.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"

namespace drape::capture {

/// Source of the trigger of an exposure.
enum class TriggerSource { free_run, software, line, action };

/// A kind of camera.
enum class Backend { aravis, v4l2, replay };
}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Backend>[] = {"aravis", "v4l2",
                                                                                "replay"};
template <>
inline constexpr std::string_view drape::names_of<drape::capture::TriggerSource>[] = {
    "free_run", "software", "line", "action"};

namespace drape::capture {

/// Address of one device: never "the first one".
struct CameraAddress {
  Backend backend = Backend::aravis;
  /// aravis: serial number or IP address; v4l2: bus path or device file; replay: the camera's name
  /// in the recording.
  std::string device;
  std::string host_address;  ///< IP address of the network card it must be reached by; or empty
  std::string recording;     ///< replay: folder of the recording
};

/// Settings wanted of a camera. Absent means: leave as the camera has it, and record what that is.
struct CameraSettings {
  std::optional<int> width_px, height_px, offset_x_px, offset_y_px;
  std::string pixel_format;  ///< empty: the first of pixel_formats() that the camera has
  std::optional<double> exposure_us, gain_db, frame_rate_hz;
  std::optional<int> packet_size_bytes, packet_delay_ns;
  TriggerSource trigger = TriggerSource::free_run;
  std::string trigger_line = "Line1";
  bool ptp = false;  ///< switch PTP on where the camera has it, and wait until it holds the clock
};

struct CameraIdentity {
  std::string vendor, model, serial, address, host_address;
};

/// A number among the settings: described once for cameras.toml, the camera host and every backend.
struct NumberSetting {
  const char *name, *meaning;  ///< with its unit, as in cameras.toml
  std::variant<std::optional<int> CameraSettings::*, std::optional<double> CameraSettings::*>
      member;
  bool own;               ///< stands in the camera's table of cameras.toml
  bool positive;          ///< above 0; else 0 or more
  double tolerance;       ///< relative difference between what is asked and taken: a sensor's step
  const char* otherwise;  ///< remedy where a camera cannot be set to it

  [[nodiscard]] std::optional<double> of(const CameraSettings& settings) const;
};
/// All of them, in the order in which cameras take them.
[[nodiscard]] std::span<const NumberSetting> number_settings();

/// One setting after it was written: what the camera says it is now.
struct SettingReadBack {
  std::string name;  ///< with its unit, e.g. "exposure_us"
  std::string value;
  bool operator==(const SettingReadBack&) const = default;
};

/// The value of a setting; nothing where the camera did not say it.
[[nodiscard]] std::optional<std::string> setting_in(std::span<const SettingReadBack> settings,
                                                    std::string_view name);

/// The format of `offered` that was asked for, or else the best for measuring. Throws
/// Error(device).
[[nodiscard]] std::string choose_pixel_format(const std::string& asked,
                                              const std::vector<std::string>& offered,
                                              const std::string& device);

/// Access of a backend to a number of the settings, in the setting's unit.
struct SettingPort {
  std::function<void(double)> write;
  std::function<double()> read;
  double step = 0;         ///< finest step, where it is known: half of it is no other value
  std::string named = {};  ///< name of the unit that the camera counts in, e.g. "gain_camera_units"
};

/// Writes the settings of one camera and keeps what it read back.
class SettingsWriter {
 public:
  SettingsWriter(std::string device, const CameraSettings& wanted)
      : device_(std::move(device)), wanted_(wanted) {}
  /// Writes the number where one is wanted, reads it back, notes it, and throws Error(device) when
  /// the camera took another one. Without a port, a number that is wanted is refused.
  void apply(std::string_view name, const std::optional<SettingPort>& port);
  void note(std::string name, std::string value);

  std::vector<SettingReadBack> read_back;

 private:
  std::string device_;
  const CameraSettings& wanted_;
};

/// A frame as it came from the device. `pixels` is valid until the next call of next().
struct CameraFrame {
  std::uint64_t id = 0;
  std::optional<std::int64_t> device_ns;
  int width_px = 0, height_px = 0;
  bool complete = false;
  std::string fault;                     ///< why it is not complete
  const std::uint8_t* pixels = nullptr;  ///< bytes as sent, in the pixel format that was set
  std::size_t bytes = 0;
  std::size_t stride_bytes = 0;  ///< bytes from row to row; 0: rows without padding
};

/// Counts of the backend, for information: the ledger counts what was expected.
struct CameraCounters {
  std::int64_t packets_requested_again = 0;
  std::int64_t packets_resent = 0;
  std::int64_t packets_repeated = 0;
  std::int64_t buffer_underruns = 0;
};

/// One camera, whatever its library. Every call throws Error(device) that names the camera's
/// device and what to do. next() may run on another thread than the rest.
class CameraDevice {
 public:
  virtual ~CameraDevice() = default;
  [[nodiscard]] virtual CameraIdentity identity() const = 0;
  /// Writes the settings in the order they depend on each other, with exposure, gain and white
  /// balance no longer automatic, and reads all of them back (SettingsWriter).
  /// "pixel_format" of what is returned names the format of the frames.
  [[nodiscard]] virtual std::vector<SettingReadBack> configure(const CameraSettings& settings) = 0;
  /// Writes the exposure and the gain that are there, also while it streams, and reads both back;
  /// throws as configure() does.
  [[nodiscard]] virtual std::vector<SettingReadBack> set_light(const CameraSettings& settings) = 0;
  [[nodiscard]] virtual FrameIdRange frame_ids() const = 0;
  [[nodiscard]] virtual std::size_t frame_bytes() const = 0;  ///< at most, after configure()
  virtual void start() = 0;
  virtual void stop() = 0;
  virtual void trigger() {}
  /// The next frame, or nothing within `timeout_s`.
  [[nodiscard]] virtual std::optional<CameraFrame> next(double timeout_s) = 0;
  /// A reading of the device's clock; empty when it cannot be read or is the host's own.
  [[nodiscard]] virtual std::optional<ClockSample> read_clock() { return std::nullopt; }
  /// True when the device's times are on the host's monotonic clock already.
  [[nodiscard]] virtual bool on_host_clock() const { return true; }
  [[nodiscard]] virtual CameraCounters counters() const { return {}; }
};

/// A device that could be named in cameras.toml.
struct FoundDevice {
  Backend backend = Backend::aravis;
  CameraIdentity identity;
  std::string name;                        ///< `device` in cameras.toml
  std::optional<int> width_px, height_px;  ///< size of its pictures, when it was asked
  std::string why_not_asked;               ///< its fault where the size is not known
};

struct FoundDevices {
  std::vector<FoundDevice> cameras;
};

/// A backend's code; camera.cpp has the table of all.
struct CameraDriver {
  std::unique_ptr<CameraDevice> (*open)(const CameraAddress&);
  std::vector<FoundDevice> (*find)();  ///< null where nothing can be found
};

[[nodiscard]] std::unique_ptr<CameraDevice> open_camera(const CameraAddress& address);

/// Devices of all backends, in order of their names. GigE Vision discovery takes about 1 s.
/// `sizes`: each is opened for a moment and asked how large its pictures are.
[[nodiscard]] std::vector<FoundDevice> find_devices(bool sizes = false);

// Descriptions of these records for files and messages.
void fields(Fields& f, CameraAddress& address);
void fields(Fields& f, CameraSettings& settings);
void fields(Fields& f, CameraIdentity& identity);
void fields(Fields& f, SettingReadBack& setting);
void fields(Fields& f, CameraCounters& counters);
void fields(Fields& f, ClockSample& sample);
void fields(Fields& f, FoundDevice& device);
void fields(Fields& f, FoundDevices& devices);
/// Describes the settings that stand in a camera's table of cameras.toml.
void own_fields(Fields& f, CameraSettings& settings);

/// Error(device) whose field says which device.
[[nodiscard]] Error device_error(std::string what_failed, const std::string& device,
                                 std::string what_to_do);

}  // namespace drape::capture

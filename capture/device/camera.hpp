// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "capture/pairing/pairing.hpp"
#include "core/error.hpp"
#include "core/fields/fields.hpp"

namespace drape::capture {

/// Storage of pixels in bytes.
enum class Packing {
  bytes,        ///< one byte per sample
  words,        ///< two bytes per sample, low byte first, value in the low bits
  lsb,          ///< samples without gaps, lowest bit first (PFNC "p")
  gige_packed,  ///< GigE Vision "Packed": two samples in three bytes, low bits in the middle byte
  yuyv,         ///< Y0 U Y1 V; only Y is used
  uyvy,         ///< U Y0 V Y1
  nv12,         ///< plane of Y, then one of U and V at half size
  rgb,          ///< three bytes per pixel; the middle one, green, is used
  jpeg          ///< one lossy JPEG picture per frame
};

/// Colour filter pattern: first two pixels of the first row.
enum class Mosaic { none, gr, rg, gb, bg };

/// A pixel format with its name in cameras.toml, from PFNC (GenICam) or V4L2.
struct PixelFormat {
  std::string_view name;
  std::uint32_t code = 0;  ///< code of PFNC, or four characters of V4L2
  int bits = 8;            ///< bits per sample
  Packing packing = Packing::bytes;
  Mosaic mosaic = Mosaic::none;

  [[nodiscard]] bool lossy() const { return packing == Packing::jpeg; }
  /// True if the grey picture holds all the data sent; otherwise the raw bytes are worth keeping.
  [[nodiscard]] bool is_grey() const;
  /// Bytes per row without padding; of the Y plane for nv12; 0 for jpeg.
  [[nodiscard]] std::size_t row_bytes(int width_px) const;
  /// Bytes of a frame with rows of `stride_bytes`; 0 for jpeg, whose size varies.
  [[nodiscard]] std::size_t frame_bytes(std::size_t stride_bytes, int height_px) const;
};

/// Every supported format, best for measuring first.
[[nodiscard]] std::span<const PixelFormat> pixel_formats();
/// Finds a format by PFNC's or V4L2's name, or by code. Null if unknown.
[[nodiscard]] const PixelFormat* find_pixel_format(std::string_view name);
[[nodiscard]] const PixelFormat* find_pixel_format(std::uint32_t code);

/// Samples of one frame, row by row, on the sensor's own scale 0 .. 2^bits - 1.
struct Samples {
  int width_px = 0, height_px = 0, bits = 8;
  std::vector<std::uint16_t> values;
};

/// Extracts the sensor's samples: the mosaic of a colour sensor, Y of YUV, green of RGB. Throws
/// Error(device) if `bytes` lacks part of the frame. `stride_bytes` 0: rows without padding.
[[nodiscard]] Samples unpack(const PixelFormat& format, std::span<const std::uint8_t> bytes,
                             int width_px, int height_px, std::size_t stride_bytes = 0);

/// Grey values for measuring. For a mosaic, green: green pixels unchanged, others the mean of their
/// two to four green neighbours, rounded half up. A lens focuses and displaces red and blue
/// differently, so one colour is used; one-sided interpolation would shift edges, so neighbours are
/// symmetric. Averaging without sharpening can only reduce noise.
[[nodiscard]] Samples grey_of(Samples samples, Mosaic mosaic);

/// Source of the signal that starts an exposure.
enum class TriggerSource { free_run, software, line, action };

/// Kind of camera interface.
enum class Backend { aravis, v4l2, replay };

/// Address of one particular device, always explicit.
struct CameraAddress {
  Backend backend = Backend::aravis;
  /// aravis: serial number or IP address; v4l2: bus path or device file; replay: name of the camera
  /// in the recording.
  std::string device;
  std::string host_address;         ///< IP address of the network card to use; can be empty
  std::filesystem::path recording;  ///< replay: folder of the recording
};

/// Requested camera settings. An absent value leaves the camera's own, which is recorded.
struct CameraSettings {
  std::optional<int> width_px, height_px, offset_x_px, offset_y_px;
  std::string pixel_format;  ///< empty: the first of pixel_formats() that the camera supports
  std::optional<double> exposure_us, gain_db, frame_rate_hz;
  std::optional<int> packet_size_bytes, packet_delay_ns;
  TriggerSource trigger = TriggerSource::free_run;
  std::string trigger_line = "Line1";
  bool ptp = false;  ///< enable PTP if available, and wait until it controls the clock
};

struct CameraIdentity {
  std::string vendor, model, serial, address, host_address;
};

/// One setting as read back from the camera after it was written.
struct SettingReadBack {
  std::string name;  ///< name with unit, e.g. "exposure_us"
  std::string value;
  bool operator==(const SettingReadBack&) const = default;
};

/// Value of a setting; nullopt if the camera did not report it.
[[nodiscard]] std::optional<std::string> setting_in(std::span<const SettingReadBack> settings,
                                                    std::string_view name);

/// Selects the requested format from `offered`, by default the best one for measuring. Throws
/// Error(device).
[[nodiscard]] std::string choose_pixel_format(const std::string& asked,
                                              const std::vector<std::string>& offered,
                                              const std::string& device);

/// Access of a backend to a numeric setting, in the setting's unit.
struct SettingPort {
  std::function<void(double)> write;
  std::function<double()> read;
  double step = 0;         ///< step size if known; deviations up to half of it are accepted
  std::string named = {};  ///< name in the camera's own unit, e.g. "gain_camera_units"
};

/// Writes the settings of one camera and keeps the values read back.
class SettingsWriter {
 public:
  SettingsWriter(std::string device, const CameraSettings& wanted)
      : device_(std::move(device)), wanted_(wanted) {}
  /// Writes a requested number, reads it back and records it. Throws Error(device) if the camera
  /// took another value, or if a number is requested and there is no port.
  void apply(std::string_view name, const std::optional<SettingPort>& port);
  void note(std::string name, std::string value);

  std::vector<SettingReadBack> read_back;

 private:
  std::string device_;
  const CameraSettings& wanted_;
};

/// Description of a frame without its pixels.
struct FrameHead {
  std::uint64_t id = 0;
  std::optional<std::int64_t> device_ns;
  bool complete = false;
  std::string fault;  ///< why the frame is incomplete
  int width_px = 0, height_px = 0;
  std::size_t stride_bytes = 0;  ///< bytes per row; 0 for rows without padding
};

/// A frame as sent by the device. `pixels` is valid until the next call of next().
struct CameraFrame : FrameHead {
  const std::uint8_t* pixels = nullptr;  ///< bytes as sent, in the configured pixel format
  std::size_t bytes = 0;
};

/// Counters of the backend, for information only; the ledger counts expected frames itself.
struct CameraCounters {
  std::int64_t packets_requested_again = 0;
  std::int64_t packets_resent = 0;
  std::int64_t packets_repeated = 0;
  std::int64_t buffer_underruns = 0;
};

/// One camera of any backend. Every call may throw Error(device), which names the device and a
/// remedy. next() may run on another thread than the rest.
class CameraDevice {
 public:
  virtual ~CameraDevice() = default;
  [[nodiscard]] virtual CameraIdentity identity() const = 0;
  /// Writes the settings in the order of their dependencies, switches off automatic exposure, gain
  /// and white balance, and reads all settings back (SettingsWriter). "pixel_format" in the result
  /// names the format of the frames.
  [[nodiscard]] virtual std::vector<SettingReadBack> configure(const CameraSettings& settings) = 0;
  /// Writes the given exposure and gain, even while streaming, and reads both back; throws like
  /// configure().
  [[nodiscard]] virtual std::vector<SettingReadBack> set_light(const CameraSettings& settings) = 0;
  [[nodiscard]] virtual FrameIdRange frame_ids() const = 0;
  [[nodiscard]] virtual std::size_t frame_bytes() const = 0;  ///< limit, known after configure()
  virtual void start() = 0;
  virtual void stop() = 0;
  virtual void trigger() {}
  /// The next frame; nullopt if none arrives within `timeout_s`.
  [[nodiscard]] virtual std::optional<CameraFrame> next(double timeout_s) = 0;
  /// Reads the device's clock; nullopt if it cannot be read or is the host's clock.
  [[nodiscard]] virtual std::optional<ClockSample> read_clock() { return std::nullopt; }
  /// True if the device's times are already on the host's monotonic clock.
  [[nodiscard]] virtual bool on_host_clock() const { return true; }
  [[nodiscard]] virtual CameraCounters counters() const { return {}; }
};

/// A device that can be named in cameras.toml.
struct FoundDevice {
  Backend backend = Backend::aravis;
  CameraIdentity identity;
  std::string name;                        ///< value for `device` in cameras.toml
  std::optional<int> width_px, height_px;  ///< image size, if requested
  std::string why_not_asked;               ///< reason why the size is unknown
};

struct FoundDevices {
  std::vector<FoundDevice> cameras;
};

/// Functions of one backend; camera.cpp lists all backends.
struct CameraDriver {
  std::unique_ptr<CameraDevice> (*open)(const CameraAddress&);
  std::vector<FoundDevice> (*find)();  ///< null if the backend cannot search
};

[[nodiscard]] std::unique_ptr<CameraDevice> open_camera(const CameraAddress& address);

/// Finds the devices of all backends, sorted by name. GigE Vision discovery takes about 1 s. With
/// `sizes`, each device is opened briefly to read its image size.
[[nodiscard]] std::vector<FoundDevice> find_devices(bool sizes = false);

// Describes these records, for files and messages.
void fields(Fields& f, CameraAddress& address);
void fields(Fields& f, CameraSettings& settings);
void fields(Fields& f, CameraIdentity& identity);
void fields(Fields& f, SettingReadBack& setting);
void fields(Fields& f, CameraCounters& counters);
void fields(Fields& f, ClockSample& sample);
void fields(Fields& f, FoundDevice& device);
void fields(Fields& f, FoundDevices& devices);
/// Describes the settings in a camera's own table of cameras.toml.
void own_fields(Fields& f, CameraSettings& settings);

/// Makes an Error(device) whose field names the device.
[[nodiscard]] Error device_error(std::string what_failed, const std::string& device,
                                 std::string what_to_do);

}  // namespace drape::capture

template <>
inline constexpr std::string_view drape::names_of<drape::capture::Backend>[] = {"aravis", "v4l2",
                                                                                "replay"};
template <>
inline constexpr std::string_view drape::names_of<drape::capture::TriggerSource>[] = {
    "free_run", "software", "line", "action"};

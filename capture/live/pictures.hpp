// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/host/camera_host.hpp"
#include "capture/live/cameras_file.hpp"
#include "capture/live/live_capture.hpp"

namespace drape::capture {

/// Converts a camera's frame to grey and depth, keeping the raw bytes if needed. A frame whose size
/// does not match its pixel format gets a fault and no pixels.
[[nodiscard]] LiveFrame develop(HostFrame frame, const std::string& pixel_format);

/// Quality of an 8-bit grey frame, independent of its content.
struct FrameQuality {
  double mean = 0;                ///< mean grey level, 0..255
  double dark_fraction = 0;       ///< pixels at level 3 or below
  double saturated_fraction = 0;  ///< pixels at level 254 or above, where some sensors saturate
  double contrast = 0;            ///< 99th minus 1st percentile of the grey level
  /// Slope of the steepest edges: the 99.9th percentile of the difference between neighbouring
  /// pixels, divided by `contrast`. A sharp edge reaches about 0.3 or more, in any light.
  double sharpness = 0;
};

struct QualityLimits {
  double least_contrast = 30;
  double largest_saturated_fraction = 0.05;
  double least_sharpness = 0.10;
};

[[nodiscard]] FrameQuality quality_of(std::span<const std::uint8_t> pixels, int width_px);

/// Explains why such a frame cannot be measured; nullopt if it can.
[[nodiscard]] std::optional<std::string> quality_fault(const FrameQuality& quality,
                                                       const QualityLimits& limits);

/// Remedy for the operator.
[[nodiscard]] std::string quality_remedy(const FrameQuality& quality, const QualityLimits& limits);

/// Preview pictures of open cameras: <folder>/<camera>.pgm, replaced atomically by each new
/// picture. A pixel is the mean of a square of the sensor's pixels, at most 254; 255 means that at
/// least one of them is saturated. The file's comment is JSON:
///
///   arrived_ns         when the frame was whole in this machine, ns since 1970 (UTC)
///   saturated_percent  of the sensor's pixels that are saturated
///   dot_sigma_px       see dot_sigma_px(); null where the picture has no contrast
///   settings           settings reported by the camera, by name
///   asked              exposure_us and gain_db last requested; null if none was
class PreviewWriter {
 public:
  PreviewWriter(const CamerasFile& cameras, std::filesystem::path folder);

  /// Writes a picture. Throws Error(bad_input) if the file cannot be written.
  void show(std::size_t camera, const LiveFrame& frame,
            const std::vector<SettingReadBack>& settings, const CameraSettings& asked);

 private:
  const CamerasFile& cameras_;
  std::filesystem::path folder_;
  struct Focus {
    std::int64_t looked_ns = 0;
    std::optional<double> dot_sigma_px;
  };
  std::vector<Focus> focus_;  ///< per camera, updated once per second
};

/// Cramer-Rao bound on the standard deviation, along one axis, of the centre of a dark dot of 10 px
/// radius that is as sharp as the sharpest edges of the frame and as noisy as its plain areas:
/// noise * sqrt(2 blur / (sqrt(pi) radius)) / contrast, for a step blurred by a Gaussian of
/// standard deviation `blur` (the squared slope integrates to contrast^2 / (2 sqrt(pi) blur) per px
/// of rim, half of which constrains one axis). The blur follows from the steepest slopes, contrast
/// / (sqrt(2 pi) blur); the noise from second differences of three neighbours, which amplify it by
/// sqrt(6). nullopt if the contrast is too low for a usable frame.
[[nodiscard]] std::optional<double> dot_sigma_px(const LiveFrame& frame);

}  // namespace drape::capture

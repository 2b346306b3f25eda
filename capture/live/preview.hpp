// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "capture/live/cameras_file.hpp"
#include "capture/live/live_capture.hpp"

namespace drape::capture {

/// Pictures for a screen of cameras that are open: <folder>/<camera>.pgm, replaced as a whole by
/// every next picture. A pixel is the mean of a square of the sensor's pixels, at most 254; it is
/// 255 where one or more of them lie at their largest value. The file's comment is JSON:
///
///   arrived_ns         when the frame was whole in this machine, ns since 1970 (UTC)
///   saturated_percent  of the sensor's pixels, at the largest value
///   dot_sigma_px       see dot_sigma_px(); null where the picture has no contrast
///   settings           what the camera says of its settings, by name
///   asked              exposure_us and gain_db that were asked for last; null where none was
class PreviewWriter {
 public:
  PreviewWriter(const CamerasFile& cameras, std::filesystem::path folder);

  /// Throws Error(bad_input) when the file cannot be written.
  void show(std::size_t camera, const LiveFrame& frame,
            const std::vector<SettingReadBack>& settings, const CameraSettings& asked);

 private:
  const CamerasFile& cameras_;
  std::filesystem::path folder_;
  struct Focus {
    std::int64_t looked_ns = 0;
    std::optional<double> dot_sigma_px;
  };
  std::vector<Focus> focus_;  ///< per camera, renewed once a second
};

/// Least standard deviation of the centre, along one axis, of a dark dot of 10 px radius, as sharp
/// as the sharpest edges of the frame and as noisy as its plain parts: the bound of Cramer and Rao,
/// noise * sqrt(2 blur / (sqrt(pi) radius)) / contrast, for a step blurred by a Gaussian of
/// standard deviation `blur` (the squared slope integrates to contrast^2 / (2 sqrt(pi) blur) per px
/// of rim, half of which tells of one axis). The blur comes from the steepest slopes, contrast /
/// (sqrt(2 pi) blur); the noise from second differences of three neighbours, which have sqrt(6) of
/// it. Nothing where the contrast is below that of a usable frame.
[[nodiscard]] std::optional<double> dot_sigma_px(const LiveFrame& frame);

}  // namespace drape::capture

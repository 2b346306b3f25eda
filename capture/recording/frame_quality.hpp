// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace drape::capture {

/// Measures of an 8-bit grey frame without knowing what it shows.
struct FrameQuality {
  double mean = 0;                ///< grey level, 0..255
  double dark_fraction = 0;       ///< pixels at level 3 or below
  double saturated_fraction = 0;  ///< pixels at level 254 or above: some sensors end there
  double contrast = 0;            ///< level of the brightest percent minus that of the darkest
  /// Steepest edges over contrast: the 99.9th percentile of the difference between neighbouring
  /// pixels, divided by `contrast`. A sharp edge reaches about 0.3 or more, whatever the light.
  double sharpness = 0;
};

struct QualityLimits {
  double least_contrast = 30;
  double largest_saturated_fraction = 0.05;
  double least_sharpness = 0.10;
};

[[nodiscard]] FrameQuality quality_of(std::span<const std::uint8_t> pixels, int width_px);

/// Why such a frame measures nothing, or nothing.
[[nodiscard]] std::optional<std::string> quality_fault(const FrameQuality& quality,
                                                       const QualityLimits& limits);

/// Remedy for the operator.
[[nodiscard]] std::string quality_remedy(const FrameQuality& quality, const QualityLimits& limits);

}  // namespace drape::capture

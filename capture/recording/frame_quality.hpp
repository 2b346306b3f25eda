// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace drape::capture {

/// Quality of an 8-bit grey frame, independent of what it shows.
struct FrameQuality {
  double mean = 0;                ///< mean grey level, 0..255
  double dark_fraction = 0;       ///< pixels at level 3 or below
  double saturated_fraction = 0;  ///< pixels at level 254 or above, where some sensors saturate
  double contrast = 0;            ///< 99th minus 1st percentile of the grey level
  /// Slope of the steepest edges: the 99.9th percentile of the difference between neighbouring
  /// pixels, divided by `contrast`. A sharp edge reaches about 0.3 or more, whatever the light.
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

}  // namespace drape::capture

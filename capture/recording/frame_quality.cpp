// SPDX-License-Identifier: Apache-2.0
#include "capture/recording/frame_quality.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include "core/statistics/sample.hpp"

namespace drape::capture {
namespace {

using Histogram = std::array<std::int64_t, 256>;

}  // namespace

FrameQuality quality_of(std::span<const std::uint8_t> pixels, int width_px) {
  FrameQuality quality;
  if (pixels.empty() || width_px < 2) return quality;
  Histogram levels{}, steps{};
  double sum = 0;
  const auto width = static_cast<std::size_t>(width_px);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    ++levels[pixels[i]];
    sum += pixels[i];
    if ((i + 1) % width != 0 && i + 1 < pixels.size())
      ++steps[static_cast<std::size_t>(std::abs(pixels[i + 1] - pixels[i]))];
  }
  const auto count = static_cast<double>(pixels.size());
  quality.mean = sum / count;
  quality.dark_fraction =
      static_cast<double>(levels[0] + levels[1] + levels[2] + levels[3]) / count;
  quality.saturated_fraction = static_cast<double>(levels[254] + levels[255]) / count;
  quality.contrast = counted_quantile(levels, 0.99) - counted_quantile(levels, 0.01);
  if (quality.contrast > 0) quality.sharpness = counted_quantile(steps, 0.999) / quality.contrast;
  return quality;
}

std::optional<std::string> quality_fault(const FrameQuality& q, const QualityLimits& limits) {
  if (q.saturated_fraction > limits.largest_saturated_fraction)
    return fmt::format("{:.0f} % of its pixels are saturated", 100 * q.saturated_fraction);
  if (q.contrast < limits.least_contrast)
    return fmt::format("{} (mean level {:.0f}, contrast {:.0f} of 255)",
                       q.dark_fraction > 0.9 ? "it is black" : "it has no contrast", q.mean,
                       q.contrast);
  if (q.sharpness < limits.least_sharpness)
    return fmt::format("it is blurred (steepest edges {:.0f} % of the contrast per px)",
                       100 * q.sharpness);
  return std::nullopt;
}

std::string quality_remedy(const FrameQuality& q, const QualityLimits& limits) {
  if (q.saturated_fraction > limits.largest_saturated_fraction)
    return "lower exposure_us or the light";
  if (q.contrast < limits.least_contrast)
    return "take the lens cap off, raise exposure_us or the light";
  return "focus the lens and lock it, then calibrate again";
}

}  // namespace drape::capture

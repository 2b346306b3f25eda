// SPDX-License-Identifier: Apache-2.0
#include "detect/image/mosaic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

constexpr int every_px = 14;  // even, so that samples begin at the same place of the mosaic
constexpr float least_level = 40, most_level = 250;
constexpr float most_change = 0.12F;  // from one 2x2 to the next where a picture is smooth
constexpr std::size_t least_samples = 200;
constexpr double least_difference = 0.03;
constexpr double clear_difference = 0.01;  // medians of 200 smooth places scatter by less than half

using Quad = std::array<float, 4>;

Quad quad_at(const GreyImage& image, int x, int y) {
  return {image.level(x, y), image.level(x + 1, y), image.level(x, y + 1),
          image.level(x + 1, y + 1)};
}

/// Level of each place over the mean of the four, median over smooth places that are `step_px`
/// apart.
std::optional<std::array<double, 4>> fractions_of(const GreyImage& image, int step_px) {
  std::array<std::vector<float>, 4> fractions;
  for (int y = 0; y + 3 < image.height_px; y += step_px) {
    for (int x = 0; x + 3 < image.width_px; x += step_px) {
      const Quad quad = quad_at(image, x, y), beside = quad_at(image, x + 2, y + 2);
      const float mean = (quad[0] + quad[1] + quad[2] + quad[3]) / 4;
      bool smooth = mean >= least_level;
      for (int k = 0; k < 4; ++k) {
        smooth =
            smooth && quad[k] <= most_level && std::abs(quad[k] - beside[k]) <= most_change * mean;
      }
      if (!smooth) continue;
      for (int k = 0; k < 4; ++k) fractions[k].push_back(quad[k] / mean);
    }
  }
  if (fractions[0].size() < least_samples) return std::nullopt;
  std::array<double, 4> medians = {};
  for (int k = 0; k < 4; ++k) {
    medians[k] = median(std::move(fractions[k]));
  }
  return medians;
}

double difference(const std::array<double, 4>& fractions) {
  const auto [darkest, brightest] = std::minmax_element(fractions.begin(), fractions.end());
  return *brightest - *darkest;
}

}  // namespace

std::optional<GreyImage> without_mosaic(const GreyImage& image) {
  // Most pictures have none by far, which a ninth of the places tells.
  const auto rough = fractions_of(image, 3 * every_px);
  if (rough && difference(*rough) < clear_difference) return std::nullopt;
  const auto fractions = fractions_of(image, every_px);
  if (!fractions || difference(*fractions) < least_difference) return std::nullopt;
  const double brightest = *std::max_element(fractions->begin(), fractions->end());
  GreyImage even = image;
  even.levels.resize(image.bytes.size());
  std::size_t at = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x, ++at) {
      const double gain = brightest / (*fractions)[static_cast<std::size_t>(y % 2) * 2 + x % 2];
      even.levels[at] = static_cast<float>(gain * image.level(x, y));
      even.bytes[at] = static_cast<std::uint8_t>(std::min(255L, std::lround(even.levels[at])));
    }
  }
  return even;
}

}  // namespace drape::detect

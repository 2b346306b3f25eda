// SPDX-License-Identifier: Apache-2.0
#include "detect/dots/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

constexpr int bands = 16;
constexpr double band_width = 256.0 / bands;
constexpr double quantisation_variance = 1.0 / 12.0;
constexpr std::size_t band_minimum = 300;
constexpr int every_px = 7;  // sampling is sufficient and costs a fiftieth

constexpr float saturated_mean = 250.0F;

/// Responses of Immerkaer's operator in one band of brightness.
struct Band {
  double level_sum = 0;
  std::vector<float> responses;  ///< absolute values
};

/// Responses at sampled pixels by band of brightness. Saturated neighbourhoods are excluded, since
/// they show no noise and would bias the estimate down.
std::array<Band, bands> bands_of(const GreyImage& image) {
  std::array<Band, bands> result;
  for (int y = 2; y + 2 < image.height_px; y += every_px) {
    for (int x = 2; x + 2 < image.width_px; x += every_px) {
      const auto at = [&](int dx, int dy) { return image.level(x + dx, y + dy); };
      const float corners = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1);
      const float sides = at(0, -1) + at(-1, 0) + at(1, 0) + at(0, 1);
      const float mean = (corners + sides + at(0, 0)) / 9.0F;
      if (mean > saturated_mean) continue;
      Band& band = result[std::min(static_cast<int>(mean / band_width), bands - 1)];
      band.level_sum += mean;
      band.responses.push_back(std::abs(corners - 2.0F * sides + 4.0F * at(0, 0)));
    }
  }
  return result;
}

/// Variance from the median absolute response; 36 is the squared norm of the operator.
double robust_variance(double median_response) {
  const double sigma = median_response / 0.67449 / 6.0;
  return sigma * sigma;
}

}  // namespace

double NoiseModel::variance(double level) const {
  return floor_variance + slope * std::clamp(level, 0.0, 255.0);
}

double NoiseModel::sigma(double level) const {
  return std::sqrt(variance(level));
}

NoiseModel estimate_noise(const GreyImage& image) {
  double sum = 0, sum_level = 0, sum_level2 = 0, sum_variance = 0, sum_product = 0;
  for (const Band& band : bands_of(image)) {
    if (band.responses.size() < band_minimum) continue;
    const auto count = static_cast<double>(band.responses.size());
    const double level = band.level_sum / count;
    const double variance = robust_variance(median(band.responses));
    // The scatter of a variance grows with it; the root of the count lets small bands contribute.
    const double weight = std::sqrt(count) /
                          ((variance + quantisation_variance) * (variance + quantisation_variance));
    sum += weight;
    sum_level += weight * level;
    sum_level2 += weight * level * level;
    sum_variance += weight * variance;
    sum_product += weight * level * variance;
  }
  if (sum <= 0) return {};
  const double mean_level = sum_level / sum;
  const double mean_variance = sum_variance / sum;
  const double spread = sum_level2 / sum - mean_level * mean_level;
  NoiseModel noise;
  if (spread > 25.0) {
    noise.slope = std::max(0.0, (sum_product / sum - mean_level * mean_variance) / spread);
  }
  noise.floor_variance = std::max(quantisation_variance, mean_variance - noise.slope * mean_level);
  return noise;
}

}  // namespace drape::detect

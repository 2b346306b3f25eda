// SPDX-License-Identifier: Apache-2.0
#include "detect/dots/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

constexpr int bands = 16;
constexpr double band_width = 256.0 / bands;
constexpr double quantisation_variance = 1.0 / 12.0;
constexpr std::size_t band_minimum = 300;
constexpr int every_px = 7;  // a sample of the frame is enough and costs a fiftieth

constexpr float saturated_mean = 250.0F;
constexpr int byte_responses = 8 * 255 + 1;  // of bytes, in absolute value

/// What Immerkaer's operator says at one place.
struct Response {
  float mean = 0, size = 0;
};

template <class Level>
Response response_at(const Level* image, std::ptrdiff_t stride) {
  const auto at = [&](int dx, int dy) { return static_cast<float>(image[dy * stride + dx]); };
  const float corners = at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1);
  const float sides = at(0, -1) + at(-1, 0) + at(1, 0) + at(0, 1);
  const float centre = at(0, 0);
  return {(corners + sides + centre) / 9.0F, std::abs(corners - 2.0F * sides + 4.0F * centre)};
}

/// Visits the responses of a sample of the frame, with the band of brightness of each. Saturated
/// neighbourhoods show no noise and would pull the estimate down.
template <class Level, class Visit>
void each_response(const GreyImage& image, const std::vector<Level>& levels, const Visit& visit) {
  for (int y = 2; y + 2 < image.height_px; y += every_px) {
    const Level* const line = levels.data() + static_cast<std::ptrdiff_t>(y) * image.width_px;
    for (int x = 2; x + 2 < image.width_px; x += every_px) {
      const Response response = response_at(line + x, image.width_px);
      if (response.mean > saturated_mean) continue;
      visit(std::min(static_cast<int>(response.mean / band_width), bands - 1), response);
    }
  }
}

/// Responses of one band of brightness.
struct Band {
  std::size_t count = 0;
  double level_sum = 0;
  double median = 0;
};

/// Responses to bytes are whole numbers: they are counted instead of sorted.
std::array<Band, bands> bands_of_bytes(const GreyImage& image) {
  std::array<Band, bands> result;
  std::vector<int> counts(static_cast<std::size_t>(bands) * byte_responses, 0);
  each_response(image, image.bytes, [&](int band, const Response& response) {
    ++result[band].count;
    result[band].level_sum += response.mean;
    ++counts[static_cast<std::size_t>(band) * byte_responses + static_cast<int>(response.size)];
  });
  for (int k = 0; k < bands; ++k) {
    const int* size = counts.data() + static_cast<std::size_t>(k) * byte_responses;
    const int* const first = size;
    std::size_t below = 0;
    while (result[k].count > 0 && below + *size <= result[k].count / 2) below += *size++;
    result[k].median = static_cast<double>(size - first);
  }
  return result;
}

std::array<Band, bands> bands_of_levels(const GreyImage& image) {
  std::array<Band, bands> result;
  std::array<std::vector<float>, bands> sizes;
  each_response(image, image.levels, [&](int band, const Response& response) {
    result[band].level_sum += response.mean;
    sizes[band].push_back(response.size);
  });
  for (int k = 0; k < bands; ++k) {
    result[k].count = sizes[k].size();
    if (sizes[k].empty()) continue;
    result[k].median = median(std::move(sizes[k]));
  }
  return result;
}

/// Variance from the median absolute response; 36 is the operator's squared norm.
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
  const std::array<Band, bands> sampled =
      image.levels.empty() ? bands_of_bytes(image) : bands_of_levels(image);
  double sum = 0, sum_level = 0, sum_level2 = 0, sum_variance = 0, sum_product = 0;
  for (const Band& band : sampled) {
    if (band.count < band_minimum) continue;
    const auto count = static_cast<double>(band.count);
    const double level = band.level_sum / count;
    const double variance = robust_variance(band.median);
    // A variance's own scatter grows with itself; square-root counts keep small bands in play.
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

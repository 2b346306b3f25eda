// SPDX-License-Identifier: Apache-2.0
#include "detect/image/image.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/files/files.hpp"
#include "core/pictures/picture.hpp"
#include "core/statistics/sample.hpp"

namespace drape::detect {
namespace {

constexpr const char* record_again =
    "record or import this set again with images of the camera's full size, 8 or 16 bit";

void require_size(std::int64_t width, std::int64_t height, int width_px, int height_px,
                  const Where& where) {
  if (width == width_px && height == height_px) return;
  throw bad_input(fmt::format("the image is {}x{} px, the rig's camera has {}x{} px", width, height,
                              width_px, height_px),
                  where, record_again);
}

/// Reads the size from a PNG's header and refuses a wrong one before allocating any
/// memory.
void check_png_size(std::span<const unsigned char> bytes, int width_px, int height_px,
                    const Where& where) {
  const std::string_view text = as_text(bytes);
  const auto width = unsigned_at(text, 16, 4), height = unsigned_at(text, 20, 4);
  if (!text.starts_with("\x89PNG\r\n\x1a\n") || !height) return;
  require_size(static_cast<std::int64_t>(*width), static_cast<std::int64_t>(*height), width_px,
               height_px, where);
}

cv::Mat grey_of(const cv::Mat& picture) {
  if (picture.channels() == 1) return picture;
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

constexpr int every_px = 14;  // even, so that samples share a position in the mosaic
constexpr float least_level = 40, most_level = 250;
constexpr float most_change = 0.12F;  // from one 2x2 to the next in a smooth area
constexpr std::size_t least_samples = 200;
constexpr double least_difference = 0.03;

using Quad = std::array<float, 4>;

Quad quad_at(const GreyImage& image, int x, int y) {
  return {image.level(x, y), image.level(x + 1, y), image.level(x, y + 1),
          image.level(x + 1, y + 1)};
}

/// Level of each position over the mean of the four, median over smooth regions.
std::optional<std::array<double, 4>> fractions_of(const GreyImage& image) {
  std::array<std::vector<float>, 4> fractions;
  for (int y = 0; y + 3 < image.height_px; y += every_px) {
    for (int x = 0; x + 3 < image.width_px; x += every_px) {
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
  const auto [darkest, brightest] = std::ranges::minmax_element(fractions);
  return *brightest - *darkest;
}

constexpr int bands = 16;
constexpr double band_width = 256.0 / bands;
constexpr double quantisation_variance = 1.0 / 12.0;
constexpr std::size_t band_minimum = 300;
constexpr int noise_step_px = 7;  // sampling is sufficient and costs a fiftieth

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
  for (int y = 2; y + 2 < image.height_px; y += noise_step_px) {
    for (int x = 2; x + 2 < image.width_px; x += noise_step_px) {
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

GreyImage decode_image(std::span<const unsigned char> bytes, int width_px, int height_px,
                       const Where& where) {
  check_png_size(bytes, width_px, height_px, where);
  const cv::Mat grey = grey_of(decode_picture(bytes, where, record_again));
  require_size(grey.cols, grey.rows, width_px, height_px, where);
  GreyImage image{width_px, height_px, {}, {}};
  image.bytes.resize(static_cast<std::size_t>(width_px) * height_px);
  cv::Mat narrow(height_px, width_px, CV_8U, image.bytes.data());
  if (grey.depth() == CV_8U) {
    grey.copyTo(narrow);
    return image;
  }
  constexpr double to_8_bit = 255.0 / 65535.0;
  grey.convertTo(narrow, CV_8U, to_8_bit);
  image.levels.resize(image.bytes.size());
  cv::Mat deep(height_px, width_px, CV_32F, image.levels.data());
  grey.convertTo(deep, CV_32F, to_8_bit);
  return image;
}

cv::Mat view_of(const GreyImage& image) {
  return {image.height_px, image.width_px, CV_8U, const_cast<std::uint8_t*>(image.bytes.data())};
}

GreyImage mirrored(GreyImage image) {
  const auto turn = [&](auto& levels) {
    for (auto row = levels.begin(); row != levels.end(); row += image.width_px)
      std::reverse(row, row + image.width_px);
  };
  turn(image.bytes);
  turn(image.levels);
  return image;
}

GreyImage negative_of(GreyImage image) {
  for (std::uint8_t& byte : image.bytes) byte = static_cast<std::uint8_t>(255 - byte);
  for (float& level : image.levels) level = 255 - level;
  image.negative = !image.negative;
  return image;
}

std::vector<unsigned char> half_scale_jpeg(const GreyImage& image) {
  cv::Mat half;
  cv::resize(view_of(image), half, {}, 0.5, 0.5, cv::INTER_AREA);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", half, bytes, {cv::IMWRITE_JPEG_QUALITY, 85});
  return bytes;
}

std::optional<GreyImage> without_mosaic(const GreyImage& image) {
  const auto fractions = fractions_of(image);
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

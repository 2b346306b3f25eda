// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "core/parallel.hpp"
#include "synth/random.hpp"
#include "synth/render/render.hpp"

namespace drape::synth {
namespace {

std::vector<double> kernel(double sigma_px) {
  const int reach = static_cast<int>(std::ceil(4 * sigma_px));
  std::vector<double> weights;
  double sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sigma_px * sigma_px)));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Blurs along rows and turns the picture over, so that twice blurs along both axes.
std::vector<double> blurred_and_turned(const std::vector<double>& from, int width, int height,
                                       const std::vector<double>& weights, int threads) {
  const int reach = static_cast<int>(weights.size()) / 2;
  std::vector<double> to(from.size());
  parallel_for(static_cast<std::size_t>(height), threads, [&](std::size_t y) {
    const double* row = from.data() + y * width;
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int k = -reach; k <= reach; ++k)
        sum += weights[k + reach] * row[std::clamp(x + k, 0, width - 1)];
      to[static_cast<std::size_t>(x) * height + y] = sum;
    }
  });
  return to;
}

}  // namespace

GreyPicture expose(const std::vector<double>& light, int width_px, int height_px,
                   std::uint64_t frame, const RenderOptions& options) {
  options.check();
  std::vector<double> level = light;
  if (options.blur_px > 0) {
    const auto weights = kernel(options.blur_px);
    level = blurred_and_turned(level, width_px, height_px, weights, options.threads);
    level = blurred_and_turned(level, height_px, width_px, weights, options.threads);
  }
  GreyPicture picture{width_px, height_px, std::vector<std::uint8_t>(level.size())};
  const std::uint64_t stream = mixed(options.seed) ^ mixed(frame + 0x517cc1b7ULL);
  parallel_for(static_cast<std::size_t>(height_px), options.threads, [&](std::size_t y) {
    for (std::size_t i = y * width_px; i < (y + 1) * width_px; ++i) {
      const double sigma =
          options.noise_grey * std::sqrt(0.5 + 0.5 * std::max(0.0, level[i]) / 128);
      const double noisy = level[i] + (sigma > 0 ? sigma * normal(stream, i) : 0);
      picture.bytes[i] = static_cast<std::uint8_t>(std::clamp(std::lround(noisy), 0L, 255L));
    }
  });
  return picture;
}

}  // namespace drape::synth

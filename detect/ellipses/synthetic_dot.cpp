// SPDX-License-Identifier: Apache-2.0
#include "detect/ellipses/synthetic_dot.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

namespace drape::test {

using namespace detect;

namespace {

constexpr int side = 64;

/// Fraction of a pixel inside the ellipse: exact along u, 32 lines along v.
double coverage(const SyntheticDot& dot, const Eigen::Matrix2d& inverse, int x, int y) {
  constexpr int lines = 32;
  double inside = 0;
  for (int j = 0; j < lines; ++j) {
    const double v = y - 0.5 + (j + 0.5) / lines - dot.centre_px.y();
    // inverse(0,0) u^2 + 2 inverse(0,1) v u + inverse(1,1) v^2 = 1
    const double half = inverse(0, 1) * v;
    const double root = half * half - inverse(0, 0) * (inverse(1, 1) * v * v - 1);
    if (root <= 0) continue;
    const double from = dot.centre_px.x() + (-half - std::sqrt(root)) / inverse(0, 0);
    const double to = dot.centre_px.x() + (-half + std::sqrt(root)) / inverse(0, 0);
    const double end = std::min({to, x + 0.5, dot.hidden_from_u});
    inside += std::max(0.0, end - std::max(from, x - 0.5)) / lines;
  }
  return inside;
}

std::vector<double> blur(const std::vector<double>& picture, double sigma, bool along_u) {
  constexpr int reach = 4;
  std::vector<double> result(picture.size(), 0.0);
  double total = 0;
  for (int k = -reach; k <= reach; ++k) total += std::exp(-0.5 * k * k / (sigma * sigma));
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      for (int k = -reach; k <= reach; ++k) {
        const int u = std::clamp(along_u ? x + k : x, 0, side - 1);
        const int v = std::clamp(along_u ? y : y + k, 0, side - 1);
        result[y * side + x] +=
            std::exp(-0.5 * k * k / (sigma * sigma)) / total * picture[v * side + u];
      }
    }
  }
  return result;
}

/// Relative changes of the light from thread to thread: white noise, blurred, of rms `size`.
std::vector<double> weave(double size, std::mt19937& random) {
  constexpr double thread_px = 0.7;
  std::normal_distribution<double> normal(0, 1);
  std::vector<double> field(side * side);
  for (double& value : field) value = normal(random);
  field = blur(blur(field, thread_px, true), thread_px, false);
  double square = 0;
  for (const double value : field) square += value * value / static_cast<double>(field.size());
  for (double& value : field) value *= size / std::sqrt(square);
  return field;
}

}  // namespace

GreyImage draw(const SyntheticDot& dot, std::mt19937& random) {
  const Eigen::Matrix2d inverse = dot.shape_px2.inverse();
  std::vector<double> picture(side * side);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double light = dot.bright * (1 + dot.slope_per_px * (x - dot.centre_px.x()));
      const double print = 1 - dot.contrast / dot.bright * coverage(dot, inverse, x, y);
      picture[y * side + x] = light * print;
    }
  }
  picture = blur(blur(picture, dot.lens_blur_px, true), dot.lens_blur_px, false);
  if (dot.texture > 0) {
    const std::vector<double> threads = weave(dot.texture / dot.bright, random);
    for (std::size_t k = 0; k < picture.size(); ++k) picture[k] *= 1 + threads[k];
  }
  std::normal_distribution<double> noise(0, dot.noise);
  GreyImage image{side, side, std::vector<std::uint8_t>(side * side), {}};
  for (std::size_t k = 0; k < picture.size(); ++k) {
    const double level = picture[k] + noise(random);
    image.bytes[k] = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    if (dot.bits > 8) {
      const double steps = std::ldexp(1.0, dot.bits - 8);
      image.levels.push_back(static_cast<float>(std::round(level * steps) / steps));
    }
  }
  return image;
}

Blob blob_of(const SyntheticDot& dot) {
  Blob blob;
  blob.label = 1;
  blob.centre_px = dot.centre_px + Eigen::Vector2d(0.3, -0.2);
  blob.shape_px2 = 1.1 * dot.shape_px2;
  blob.bright = dot.bright;
  blob.dark = dot.bright - dot.contrast;
  return blob;
}

}  // namespace drape::test

// SPDX-License-Identifier: Apache-2.0
#include "detect/blobs.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace drape {
namespace {

constexpr double smallest_radius_ratio = 0.5;
constexpr double largest_radius_ratio = 1.7;
constexpr double least_fill = 0.80;
constexpr double most_dark_ring = 0.45;
constexpr int ring_samples = 32;

/// The light that falls on the unprinted surface: a morphological closing, which fills whatever is
/// too small to hold the square and keeps shadow edges. At half scale, from the brightest of each
/// 2x2 pixels, for speed.
cv::Mat surface_light(const cv::Mat& picture, int side_px) {
  cv::Mat half((picture.rows + 1) / 2, (picture.cols + 1) / 2, CV_8U);
  for (int y = 0; y < half.rows; ++y) {
    const auto* upper = picture.ptr<std::uint8_t>(2 * y);
    const auto* lower = picture.ptr<std::uint8_t>(std::min(2 * y + 1, picture.rows - 1));
    auto* out = half.ptr<std::uint8_t>(y);
    for (int x = 0; x < half.cols; ++x) {
      const int right = std::min(2 * x + 1, picture.cols - 1);
      out[x] = std::max(std::max(upper[2 * x], upper[right]), std::max(lower[2 * x], lower[right]));
    }
  }
  const int side = std::max(3, (side_px / 2) | 1);
  cv::morphologyEx(half, half, cv::MORPH_CLOSE, cv::Mat::ones(side, side, CV_8U));
  return half;
}

/// Pixels darker than half the surface's light, by more than noise can be.
cv::Mat dark_mask(const cv::Mat& picture, const NoiseModel& noise, int side_px) {
  std::array<int, 256> limit = {};
  for (int light = 0; light < 256; ++light) {
    const double least_contrast = std::max(6.0, 5.0 * noise.sigma(light));
    limit[light] = static_cast<int>(std::floor(std::min(0.5 * light, light - least_contrast)));
  }
  const cv::Mat light = surface_light(picture, side_px);
  cv::Mat mask(picture.rows, picture.cols, CV_8U);
  for (int y = 0; y < picture.rows; ++y) {
    const auto* line = picture.ptr<std::uint8_t>(y);
    const auto* above = light.ptr<std::uint8_t>(y / 2);
    auto* out = mask.ptr<std::uint8_t>(y);
    for (int x = 0; x < picture.cols; ++x) out[x] = line[x] < limit[above[x / 2]] ? 255 : 0;
  }
  return mask;
}

struct Region {
  cv::Rect box;
  double area = 0;
};

bool plausible_size(const Region& region, double radius_px) {
  const double largest = largest_radius_ratio * radius_px;
  return region.area >= 6 && region.box.width <= 2 * largest + 2 &&
         region.box.height <= 2 * largest + 2 &&
         std::max(region.box.width, region.box.height) >= smallest_radius_ratio * radius_px;
}

/// Centre and shape from second moments: a filled ellipse has J J^T = 4 times its covariance.
void moments(const DarkMap& map, const Region& region, Blob& blob) {
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  for (int y = region.box.y; y < region.box.y + region.box.height; ++y) {
    for (int x = region.box.x; x < region.box.x + region.box.width; ++x) {
      if (map.at(x, y) != blob.label) continue;
      const Eigen::Vector2d p(x - region.box.x, y - region.box.y);
      count += 1;
      sum += p;
      square += p * p.transpose();
    }
  }
  const Eigen::Vector2d mean = sum / count;
  blob.centre_px = mean + Eigen::Vector2d(region.box.x, region.box.y);
  // A pixel has an extent of its own: 1/12 per axis keeps thin regions from becoming lines.
  blob.shape_px2 =
      4 * (square / count - mean * mean.transpose() + Eigen::Matrix2d::Identity() / 12.0);
}

/// Brightness inside and just outside, and how much of the outside is dark itself.
void look_around(const GreyImage& image, const DarkMap& map, Blob& blob) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(blob.shape_px2);
  const Eigen::Vector2d axes = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  std::vector<float> ring;
  double core = 0;
  for (int k = 0; k < ring_samples; ++k) {
    const double angle = 2 * std::numbers::pi * k / ring_samples;
    const Eigen::Vector2d unit(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d out =
        blob.centre_px + eigen.eigenvectors() * unit.cwiseProduct(axes + Eigen::Vector2d(2.5, 2.5));
    const Eigen::Vector2d in =
        blob.centre_px + eigen.eigenvectors() * unit.cwiseProduct(0.4 * axes);
    const int x = static_cast<int>(std::lround(out.x()));
    const int y = static_cast<int>(std::lround(out.y()));
    core +=
        image.level(static_cast<int>(std::lround(in.x())), static_cast<int>(std::lround(in.y()))) /
        ring_samples;
    if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) continue;
    ring.push_back(map.at(x, y) != 0 ? 0.0F : image.level(x, y));
  }
  blob.dark = core;
  blob.dark_ring = 1.0;
  if (ring.empty()) return;
  std::sort(ring.begin(), ring.end());
  blob.bright = ring[ring.size() * 2 / 3];
  const auto half = static_cast<float>(0.5 * (blob.dark + blob.bright));
  blob.dark_ring =
      static_cast<double>(std::lower_bound(ring.begin(), ring.end(), half) - ring.begin()) /
      static_cast<double>(ring.size());
}

bool dot_like(const Blob& blob, const Region& region, double radius_px) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(blob.shape_px2,
                                                             Eigen::EigenvaluesOnly);
  const double major = std::sqrt(eigen.eigenvalues()(1));
  const double minor = std::sqrt(std::max(0.0, eigen.eigenvalues()(0)));
  const double fill = region.area / (std::numbers::pi * major * minor);
  return major >= smallest_radius_ratio * radius_px && major <= largest_radius_ratio * radius_px &&
         fill >= least_fill && blob.dark_ring <= most_dark_ring && blob.bright > blob.dark;
}

}  // namespace

Blobs find_blobs(const GreyImage& image, const NoiseModel& noise, double radius_px) {
  const cv::Mat picture(image.height_px, image.width_px, CV_8U,
                        const_cast<std::uint8_t*>(image.bytes.data()));
  // Wide enough for the largest dot: a square inside a circle has 1.41 radii.
  const int side_px = static_cast<int>(std::ceil(1.5 * largest_radius_ratio * radius_px)) + 2;
  Blobs result;
  result.map = {image.width_px, image.height_px, {}};
  result.map.labels.resize(image.bytes.size());
  cv::Mat labels(image.height_px, image.width_px, CV_32S, result.map.labels.data());
  cv::Mat stats, centroids;
  const int count = cv::connectedComponentsWithStats(dark_mask(picture, noise, side_px), labels,
                                                     stats, centroids, 8, CV_32S);
  for (int label = 1; label < count; ++label) {
    const int* row = stats.ptr<int>(label);
    const Region region{{row[cv::CC_STAT_LEFT], row[cv::CC_STAT_TOP], row[cv::CC_STAT_WIDTH],
                         row[cv::CC_STAT_HEIGHT]},
                        static_cast<double>(row[cv::CC_STAT_AREA])};
    if (!plausible_size(region, radius_px)) continue;
    Blob blob;
    blob.label = label;
    moments(result.map, region, blob);
    look_around(image, result.map, blob);
    if (dot_like(blob, region, radius_px)) result.blobs.push_back(blob);
  }
  return result;
}

}  // namespace drape

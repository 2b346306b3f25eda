// SPDX-License-Identifier: Apache-2.0
#include "detect/image/image.hpp"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace drape::detect {
namespace {

/// Position of the first marked pixel at or after x.
int next_marked(const std::uint8_t* line, int x, int width) {
  for (std::uint64_t eight = 0; x + 8 <= width; x += 8) {
    std::memcpy(&eight, line + x, sizeof eight);
    if (eight != 0) break;
  }
  while (x < width && line[x] == 0) ++x;
  return x;
}

constexpr double least_fill = 0.80;
constexpr double most_dark_ring = 0.45;
constexpr int ring_samples = 32;
constexpr double ink_level = 0.5;  // largest fraction of the surrounding brightness
/// The same for a negative picture: white dots in dim light are far from the full level, which a
/// black plate reaches nearly everywhere.
constexpr double negative_ink_level = 0.85;
constexpr double full_core = 0.4;  // radius of the dark core, in radii of the dot
constexpr double ring_core = 0.7;  // the same for dots with a light centre

/// Bounding box and pixel count of a connected set of marked pixels.
struct Region {
  int left = 0, top = 0, width = 0, height = 0;
  double area = 0;
};

/// Finds 8-connected regions of marked pixels, row by row. Works on runs of marked pixels, so that
/// unmarked areas cost almost nothing and no image is stored.
class RegionFinder {
 public:
  RegionFinder(int width_px, int height_px) {
    map_.width_px = width_px;
    map_.height_px = height_px;
    map_.row_begins.reserve(static_cast<std::size_t>(height_px) + 1);
    map_.row_begins.push_back(0);
  }

  /// Adds the next row from the top: `width_px` bytes, non-zero where marked.
  void add_row(const std::uint8_t* marked) {
    const int width = map_.width_px;
    std::vector<DarkRun>& runs = map_.runs;
    const std::size_t above_end = runs.size();
    std::size_t touching =
        map_.row_begins.size() > 1 ? map_.row_begins[map_.row_begins.size() - 2] : above_end;
    for (int x = next_marked(marked, 0, width); x < width; x = next_marked(marked, x, width)) {
      int end = x;
      while (end < width && marked[end] != 0) ++end;
      const int index = static_cast<int>(runs.size());
      runs.push_back({x, end, 0});
      parents_.push_back(index);
      while (touching < above_end && runs[touching].to < x) ++touching;
      for (std::size_t k = touching; k < above_end && runs[k].from <= end; ++k) {
        join(static_cast<int>(k), index);
      }
      x = end;
    }
    map_.row_begins.push_back(runs.size());
  }

  /// Returns the regions in the order of their first pixels, once all rows are added. The region
  /// with index k has label k + 1 in `map`.
  [[nodiscard]] std::vector<Region> finish(DarkMap& map) {
    std::vector<Region> regions;
    for (int y = 0; y < map_.height_px; ++y) {
      for (std::size_t k = map_.row_begins[y]; k < map_.row_begins[y + 1]; ++k) {
        DarkRun& run = map_.runs[k];
        const int root = root_of(static_cast<int>(k));
        if (root == static_cast<int>(k)) {
          regions.push_back({run.from, y, 0, 0, 0});
          run.label = static_cast<std::int32_t>(regions.size());
        }
        run.label = map_.runs[root].label;
        Region& region = regions[run.label - 1];
        const int right = std::max(region.left + region.width, run.to);
        region.left = std::min(region.left, run.from);
        region.width = right - region.left;
        region.height = y - region.top + 1;
        region.area += run.to - run.from;
      }
    }
    map = std::move(map_);
    return regions;
  }

 private:
  [[nodiscard]] int root_of(int run) {
    while (parents_[run] != run) {
      parents_[run] = parents_[parents_[run]];
      run = parents_[run];
    }
    return run;
  }
  void join(int a, int b) {
    const int first = root_of(a), second = root_of(b);
    parents_[std::max(first, second)] = std::min(first, second);
  }

  DarkMap map_;
  std::vector<int> parents_;  ///< per run: an earlier or the same run of its region
};

/// Brightness of the unprinted surface by morphological closing, which fills anything smaller than
/// the square and preserves shadow edges. Computed at half scale from the brightest of each 2x2
/// pixels, for speed.
cv::Mat surface_light(const cv::Mat& picture, int side_px) {
  cv::Mat half((picture.rows + 1) / 2, (picture.cols + 1) / 2, CV_8U);
  std::vector<std::uint8_t> pairs(2 * static_cast<std::size_t>(half.cols));
  for (int y = 0; y < half.rows; ++y) {
    const auto* const __restrict upper = picture.ptr<std::uint8_t>(2 * y);
    const auto* const __restrict lower =
        picture.ptr<std::uint8_t>(std::min(2 * y + 1, picture.rows - 1));
    std::uint8_t* const __restrict pair = pairs.data();
    const int width = picture.cols;
    for (int x = 0; x < width; ++x) pair[x] = std::max(upper[x], lower[x]);
    pairs.back() = pair[width - 1];
    auto* const __restrict out = half.ptr<std::uint8_t>(y);
    const int half_width = half.cols;
    for (int x = 0; x < half_width; ++x) out[x] = std::max(pair[2 * x], pair[2 * x + 1]);
  }
  const int side = std::max(3, (side_px / 2) | 1);
  cv::morphologyEx(half, half, cv::MORPH_CLOSE, cv::Mat::ones(side, side, CV_8U));
  return half;
}

/// Finds regions of pixels darker than a fraction of the surface's brightness, beyond the noise.
std::vector<Region> dark_regions(const GreyImage& image, const NoiseModel& noise, int side_px,
                                 DarkMap& map) {
  const cv::Mat picture = view_of(image);
  const double ink = image.negative ? negative_ink_level : ink_level;
  std::array<std::uint8_t, 256> limit = {};
  for (int light = 0; light < 256; ++light) {
    const double least_contrast = std::max(6.0, 5.0 * noise.sigma(light));
    const double darkest = std::floor(std::min(ink * light, light - least_contrast));
    limit[light] = static_cast<std::uint8_t>(std::max(0.0, darkest));
  }
  const cv::Mat light = surface_light(picture, side_px);
  std::vector<std::uint8_t> mask(picture.cols);
  std::vector<std::uint8_t> half_limits(light.cols), limits(2 * half_limits.size());
  RegionFinder finder(picture.cols, picture.rows);
  for (int y = 0; y < picture.rows; ++y) {
    std::uint8_t* const __restrict darkest = limits.data();
    if (y % 2 == 0) {
      const auto* const __restrict above = light.ptr<std::uint8_t>(y / 2);
      std::uint8_t* const __restrict once = half_limits.data();
      const int half_width = light.cols;
      for (int x = 0; x < half_width; ++x) once[x] = limit[above[x]];
      for (int x = 0; x < half_width; ++x) darkest[2 * x] = darkest[2 * x + 1] = once[x];
    }
    const auto* const __restrict line = picture.ptr<std::uint8_t>(y);
    std::uint8_t* const __restrict out = mask.data();
    const int width = picture.cols;
    for (int x = 0; x < width; ++x) out[x] = line[x] < darkest[x] ? 1 : 0;
    finder.add_row(mask.data());
  }
  return finder.finish(map);
}

bool plausible_size(const Region& region, const DotSizes& sizes) {
  const double largest = sizes.largest_px;
  return region.area >= 6 && region.width <= 2 * largest + 2 && region.height <= 2 * largest + 2 &&
         std::max(region.width, region.height) >= sizes.smallest_px;
}

/// First pixel of a region in a row, and one past its last; equal if there is none.
std::pair<int, int> row_ends(const DarkMap& map, const Region& region, std::int32_t label, int y) {
  int first = region.left + region.width, end = first;
  for (const DarkRun& run : map.row_from(region.left, y)) {
    if (run.from >= region.left + region.width) break;
    if (run.label != label) continue;
    first = std::min(first, run.from);
    end = run.to;
  }
  return {first, end};
}

/// Computes centre and shape from second moments: J J^T of a filled ellipse is 4 times its
/// covariance. Returns the pixel count; with `fill`, pixels between a row's ends count too.
double moments(const DarkMap& map, const Region& region, bool fill, Blob& blob) {
  double count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero();
  const auto add = [&](int from, int to, int y) {
    for (int x = from; x < to; ++x) {
      const Eigen::Vector2d p(x - region.left, y - region.top);
      count += 1;
      sum += p;
      square += p * p.transpose();
    }
  };
  for (int y = region.top; y < region.top + region.height; ++y) {
    if (fill) {
      const auto [first, end] = row_ends(map, region, blob.label, y);
      add(first, end, y);
      continue;
    }
    for (const DarkRun& run : map.row_from(region.left, y)) {
      if (run.from >= region.left + region.width) break;
      if (run.label == blob.label) add(run.from, run.to, y);
    }
  }
  const Eigen::Vector2d mean = sum / count;
  blob.centre_px = mean + Eigen::Vector2d(region.left, region.top);
  // The extent of a pixel, 1/12 px^2 per axis, keeps thin regions from degenerating to lines.
  blob.shape_px2 =
      4 * (square / count - mean * mean.transpose() + Eigen::Matrix2d::Identity() / 12.0);
  return count;
}

/// Measures brightness inside and just outside, and the dark fraction of the outside.
void look_around(const GreyImage& image, const DarkMap& map, double core_radius, Blob& blob) {
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
        blob.centre_px + eigen.eigenvectors() * unit.cwiseProduct(core_radius * axes);
    const int x = static_cast<int>(std::lround(out.x()));
    const int y = static_cast<int>(std::lround(out.y()));
    // The ellipse of a region that is not a dot can extend outside the picture.
    core += image.level(std::clamp(static_cast<int>(std::lround(in.x())), 0, image.width_px - 1),
                        std::clamp(static_cast<int>(std::lround(in.y())), 0, image.height_px - 1)) /
            ring_samples;
    if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) continue;
    ring.push_back(map.at(x, y) != 0 ? 0.0F : image.level(x, y));
  }
  blob.dark = core;
  blob.dark_ring = 1.0;
  if (ring.empty()) return;
  std::ranges::sort(ring);
  blob.bright = ring[ring.size() * 2 / 3];
  const auto half = static_cast<float>(0.5 * (blob.dark + blob.bright));
  blob.dark_ring = static_cast<double>(std::ranges::lower_bound(ring, half) - ring.begin()) /
                   static_cast<double>(ring.size());
}

bool dot_like(const Blob& blob, double area, const DotSizes& sizes) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(blob.shape_px2,
                                                             Eigen::EigenvaluesOnly);
  const double major = std::sqrt(eigen.eigenvalues()(1));
  const double minor = std::sqrt(std::max(0.0, eigen.eigenvalues()(0)));
  const double fill = area / (std::numbers::pi * major * minor);
  return major >= sizes.smallest_px && major <= sizes.largest_px && fill >= least_fill &&
         blob.dark_ring <= most_dark_ring && blob.bright > blob.dark;
}

}  // namespace

Blobs find_blobs(const GreyImage& image, const NoiseModel& noise, const DotSizes& sizes,
                 bool light_centres) {
  // Side larger than the largest dot: the square inscribed in a circle has a side of 1.41 radii.
  const int side_px = static_cast<int>(std::ceil(1.5 * sizes.largest_px)) + 2;
  Blobs result;
  const std::vector<Region> regions = dark_regions(image, noise, side_px, result.map);
  for (std::size_t k = 0; k < regions.size(); ++k) {
    if (!plausible_size(regions[k], sizes)) continue;
    Blob blob;
    blob.label = static_cast<std::int32_t>(k) + 1;
    const double area = moments(result.map, regions[k], light_centres, blob);
    look_around(image, result.map, light_centres ? ring_core : full_core, blob);
    if (dot_like(blob, area, sizes)) result.blobs.push_back(blob);
  }
  return result;
}

}  // namespace drape::detect

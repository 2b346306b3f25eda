// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/error.hpp"

namespace cv {
class Mat;
}

namespace drape::detect {

/// A grey image. Pixel (0, 0) is the centre of the top-left pixel.
struct GreyImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> bytes;  ///< row-major, 0..255
  /// For 16-bit sources only: the same picture at full depth, on the scale 0..255.
  std::vector<float> levels;
  bool negative = false;  ///< light and dark are exchanged

  /// Grey level 0..255 of a pixel; the pixel must be inside the image.
  [[nodiscard]] float level(int x, int y) const {
    const std::size_t index = static_cast<std::size_t>(y) * width_px + x;
    return levels.empty() ? static_cast<float>(bytes[index]) : levels[index];
  }
};

/// View of the picture's bytes, without a copy, for OpenCV to read.
[[nodiscard]] cv::Mat view_of(const GreyImage& image);

/// Mirrors the picture left to right.
[[nodiscard]] GreyImage mirrored(GreyImage image);

/// Exchanges light and dark.
[[nodiscard]] GreyImage negative_of(GreyImage image);

/// Decodes PNG, JPEG or TIFF; converts colour to grey and keeps the depth of 16 bits. Throws
/// Error(bad_input) at `where` if the bytes are not a picture, the depth is neither 8 nor 16 bit,
/// or the size is not `width_px` x `height_px`.
[[nodiscard]] GreyImage decode_image(std::span<const unsigned char> bytes, int width_px,
                                     int height_px, const Where& where);

/// JPEG of the picture at half size, for reports. Deterministic.
[[nodiscard]] std::vector<unsigned char> half_scale_jpeg(const GreyImage& image);

/// Equalises the raw mosaic of a colour sensor that was read as grey: the four positions of each
/// 2x2 pixels see the same white cloth at different levels. Scales each to the brightest one's
/// level by its own gain (median over smooth regions); nullopt for a picture whose four positions
/// agree within 3 %.
[[nodiscard]] std::optional<GreyImage> without_mosaic(const GreyImage& image);

/// Noise of one frame: variance = floor + slope * level (read-out and quantisation noise plus the
/// shot noise of a linear sensor), in grey levels of the 0..255 scale.
struct NoiseModel {
  double floor_variance = 1;
  double slope = 0;

  [[nodiscard]] double variance(double level) const;
  [[nodiscard]] double sigma(double level) const;
};

/// Estimates the noise from the frame itself: median response, in bands of brightness, of
/// Immerkaer's (1996) difference operator, which cancels planes.
[[nodiscard]] NoiseModel estimate_noise(const GreyImage& image);

/// Pixels [from, to) of one row that belong to one region.
struct DarkRun {
  int from = 0, to = 0;
  std::int32_t label = 0;  ///< number of the region, from 1
};

/// Connected printed (dark) regions of a frame: below half the brightness of the surrounding
/// surface. Stored as runs: a label image would take four times the memory of the frame.
struct DarkMap {
  int width_px = 0;
  int height_px = 0;
  std::vector<DarkRun> runs;            ///< row by row, from left to right
  std::vector<std::size_t> row_begins;  ///< first run of each row, then the number of runs

  [[nodiscard]] std::span<const DarkRun> row(int y) const {
    const std::size_t first = row_begins[static_cast<std::size_t>(y)];
    return {runs.data() + first, row_begins[static_cast<std::size_t>(y) + 1] - first};
  }

  /// Runs of a row that end right of x; empty outside the image.
  [[nodiscard]] std::span<const DarkRun> row_from(int x, int y) const {
    if (y < 0 || y >= height_px) return {};
    const std::span<const DarkRun> all = row(y);
    const auto first =
        std::ranges::partition_point(all, [x](const DarkRun& run) { return run.to <= x; });
    return all.subspan(static_cast<std::size_t>(first - all.begin()));
  }

  /// Region at a pixel; 0 on unprinted pixels and outside the image.
  [[nodiscard]] std::int32_t at(int x, int y) const {
    const std::span<const DarkRun> runs_from = row_from(x, y);
    return runs_from.empty() || runs_from.front().from > x ? 0 : runs_from.front().label;
  }
};

/// A dark region with the size and outline of a dot.
struct Blob {
  std::int32_t label = 0;
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d shape_px2;  ///< J J^T of the ellipse; its eigenvalues are the squared semi-axes
  double bright = 0;          ///< grey level exceeded by a third of the surrounding ring
  double dark = 0;            ///< mean grey level of the core
  double dark_ring = 0;       ///< fraction of the ring that is printed or as dark as the blob
};

struct Blobs {
  DarkMap map;
  std::vector<Blob> blobs;  ///< in raster order
};

/// Range of semi-major axes of the dots in a frame.
struct DotSizes {
  double smallest_px = 0, largest_px = 0;

  /// Range for a given unforeshortened radius: half to 1.7 times, since depth varies.
  static DotSizes around(double radius_px) { return {0.5 * radius_px, 1.7 * radius_px}; }
};

/// Finds dots within these sizes; with `light_centres` also ring-shaped ones.
[[nodiscard]] Blobs find_blobs(const GreyImage& image, const NoiseModel& noise,
                               const DotSizes& sizes, bool light_centres = false);

}  // namespace drape::detect

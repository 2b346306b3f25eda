// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "detect/dots/dark_map.hpp"
#include "detect/dots/noise.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

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

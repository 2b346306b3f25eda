// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "detect/dots/blobs.hpp"
#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// A pixel of a patch; positions are relative to the patch's origin.
struct PatchPixel {
  int x = 0, y = 0;
  double level = 0;
  double distance = 0;  ///< from the initial outline, positive outside
  int sector = 0;       ///< which eighth of the dot
  double trust = 1;     ///< initial weight
};

/// Pixels used to fit a dot: its ellipse and a ring around it.
struct Patch {
  Eigen::Vector2i origin;  ///< image position of the blob's centre, rounded
  int reach_x = 0, reach_y = 0;
  std::vector<PatchPixel> pixels;
  double masked_edge = 0;  ///< unusable fraction of the outline
  bool saturated = false;
};

/// Cuts out the patch of a blob, without pixels near other dark regions or outside the image.
/// `start` is relative to the rounded centre. If dots can have a light centre (its fraction of the
/// radius is not 0), the core is left out of every dot: only the outline locates it.
[[nodiscard]] Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob,
                              const BlurredEllipse& start, double light_centre_fraction);

/// Before the first fit, excludes ring pixels much darker than the brighter part of the ring:
/// table, or shadowed cloth behind a silhouette. True if there were any.
bool set_dark_ring_aside(Patch& patch);

}  // namespace drape::detect

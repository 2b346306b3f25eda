// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "detect/dots/blobs.hpp"
#include "detect/ellipses/blurred_ellipse.hpp"
#include "detect/image/image.hpp"

namespace drape::detect {

/// A pixel of a patch; positions relative to the patch's origin.
struct PatchPixel {
  int x = 0, y = 0;
  double level = 0;
  double distance = 0;  ///< from the outline that the fit begins with, positive outside
  int sector = 0;       ///< eighth of the dot
  double trust = 1;     ///< weight that the fit begins with
};

/// The pixels that a dot is fitted to: its ellipse and a ring around it.
struct Patch {
  Eigen::Vector2i origin;  ///< image position of the blob's centre, rounded
  int reach_x = 0, reach_y = 0;
  std::vector<PatchPixel> pixels;
  double masked_edge = 0;  ///< fraction of the outline that is not usable
  bool saturated = false;
};

/// Cuts the patch of a blob, without pixels near other dark regions or outside the image.
/// `start` is relative to the rounded centre. Where some dots have a light centre (its fraction of
/// the radius is not 0) the core of none is used: the outline alone says where the dot is.
[[nodiscard]] Patch cut_patch(const GreyImage& image, const DarkMap& map, const Blob& blob,
                              const BlurredEllipse& start, double light_centre_fraction);

/// Before the first fit: ring pixels much darker than the brighter part of the ring are taken for
/// the table, or for cloth in shadow behind a silhouette. True when there were any.
bool set_dark_ring_aside(Patch& patch);

}  // namespace drape::detect

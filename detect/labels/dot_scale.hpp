// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "detect/dots/blobs.hpp"
#include "detect/dots/dot_steps.hpp"
#include "detect/dots/noise.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// Blobs as dots to be labelled, before they are fitted.
[[nodiscard]] std::vector<UnlabelledDot> dots_of(const std::vector<Blob>& blobs);

/// Unforeshortened radius of most blobs that have others about a pitch away; nothing when there
/// are no such blobs.
[[nodiscard]] std::optional<double> common_radius_px(const std::vector<Blob>& blobs,
                                                     const PrintPlane& plane);

/// Sizes of the dots in a picture of a usual bench, and the search for any other.
[[nodiscard]] DotSizes usual_sizes();

/// Radius of the dots that stand in the largest piece of the print's lattice, looked for at all
/// sizes; needs no tag. Nothing when no piece has nine dots.
[[nodiscard]] std::optional<double> lattice_radius_px(const GreyImage& image,
                                                      const NoiseModel& noise,
                                                      const PrintPlane& plane);

}  // namespace drape::detect

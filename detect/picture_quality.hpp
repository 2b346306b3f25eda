// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/detections.hpp"
#include "detect/frame.hpp"

namespace drape::detect {

/// What a picture's grey levels say of its light and sharpness.
struct PictureQuality {
  double dark = 0, light = 0;  ///< grey levels that 1 % of the pixels lie below, and above
  double edge_px = 0;          ///< Gaussian width of its sharpest edges
  bool deep = false;           ///< more than 8 bits a pixel
};
[[nodiscard]] PictureQuality quality_of(const GreyImage& image);

/// Views that show less than half of the marks of their set's best view, and whose light or
/// sharpness is less than half of what the other pictures have: what is wrong, and what it cost.
/// One sentence each. `qualities` are those of `frames`.
[[nodiscard]] std::vector<std::string> poor_views(const std::vector<FrameDetections>& frames,
                                                  const std::vector<PictureQuality>& qualities);

/// Pictures that use less than a sixteenth of the grey levels: the first and how many. Empty when
/// there is none. Throws Error(bad_input) where the first has more than 8 bits, as 12 bits in the
/// low bits of 16: few marks would be seen, and the sheet measured by these.
[[nodiscard]] std::string unused_levels(const std::vector<FrameDetections>& frames,
                                        const std::vector<PictureQuality>& qualities);

/// Why a picture has dots without labels, where it tells: tags of another family, other ids, a
/// mirrored picture; where none `has_labels`, dots of another size too. `file` is the print's or
/// target's, for the sentence. Empty when nothing is known.
[[nodiscard]] std::string why_no_mark(const GreyImage& image, const PrintPlane& plane,
                                      const FrameLimits& limits, bool has_labels,
                                      const std::string& file);

}  // namespace drape::detect

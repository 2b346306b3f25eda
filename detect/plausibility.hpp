// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/detections.hpp"
#include "detect/frame.hpp"
#include "detect/labels/print_plane.hpp"

namespace drape::detect {

/// Light and sharpness of a picture by its grey levels.
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

/// Measured over stated diameter of the dots: the fitted ellipse's area over that
/// of a dot where its neighbours lie as they do. A blur of width s takes pi s^2 of the area within
/// any convex outline (s^2 / 2 times its curvature, all around), which is added. Median over the
/// dots between four neighbours, or, below 20 of these, over those with one along each axis;
/// nothing below 20 of them, or for a lattice of corners. Cloth bends between neighbours, so single
/// dots scatter by some 10 %; on bench1 the median is within 0.3 % on cloth and 0.1 % on the
/// target. `blurs_px` are those of `frames`.
[[nodiscard]] std::optional<double> dot_size_ratio(const std::vector<FrameDetections>& frames,
                                                   const std::vector<double>& blurs_px,
                                                   const MarkLattice& lattice);

/// Why the dots cannot have the stated size: off by more than 10 %, where the correction of their
/// shape, which goes with the square, errs by a fifth. Empty when they can. `file` for the
/// sentence.
[[nodiscard]] std::string other_dot_size(const std::optional<double>& ratio,
                                         const MarkLattice& lattice, const std::string& file);

/// Why the tags of a picture cannot lie where the print says; empty where they can. Two tags are
/// never farther apart in a picture than on the print, at the scale of the nearest tag; and each
/// tag says by its own corners in which direction the others lie. `file` is the print's or
/// target's.
[[nodiscard]] std::string tags_elsewhere(const PrintPlane& plane,
                                         const std::vector<TagDetection>& tags,
                                         const std::string& file);

}  // namespace drape::detect

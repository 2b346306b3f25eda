// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/detections.hpp"
#include "detect/dots/dot_steps.hpp"
#include "detect/image/image.hpp"
#include "detect/labels/print_plane.hpp"
#include "detect/tags/tags.hpp"

namespace drape::detect {

/// True when the print has tags and every one sits in the middle of four dots.
[[nodiscard]] bool tags_sit_between_dots(const PrintPlane& plane);

/// Reads the tags of a print where its dots say that they are: each four dots that stand as the
/// corners of one cell span a map, through which the modules are sampled. First the projective map
/// of a flat cell, then one that bends as the four ellipses say. Bending that spoils a tag's
/// outline leaves the modules readable, and only a few thousand pixels are looked at. Up to two
/// wrong bits are corrected. Ordered by id; an id read in two places is left out.
[[nodiscard]] std::vector<TagDetection> read_tags_between_dots(
    const GreyImage& image, const PrintPlane& plane, const TagCode& code,
    const std::vector<UnlabelledDot>& dots, double noise_sigma);

}  // namespace drape::detect

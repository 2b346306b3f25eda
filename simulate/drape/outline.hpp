// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "simulate/mesh/material_mesh.hpp"

namespace drape::simulate {

/// Reads the outline of a piece of cloth, in the frame of the print's patch (warp from mark row 0
/// on, weft from mark col 0 on), and divides its curves into pieces of about `spacing_m`. The ring
/// with the largest area is the outer border, the others are holes.
/// - `.svg` (SVG 1.1): x along the weft, y, which points down, along the warp, as the patch is seen
///   from its printed side. Width and height state the size of the viewBox in mm, cm, in or px
///   (1/96 in). Closed paths, polygons, rectangles, circles and ellipses, with transforms.
/// - `.csv`: columns `ring,warp_mm,weft_mm`, one corner per line, grouped by ring number. Throws
///   Error(bad_input) naming file and element or line for open lines, text, other elements, a size
///   without unit, rings outside the outer one, or if there is no ring.
[[nodiscard]] ClothOutline read_outline(const std::filesystem::path& file, double spacing_m);

}  // namespace drape::simulate

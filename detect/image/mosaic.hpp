// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "detect/image/image.hpp"

namespace drape::detect {

/// A colour sensor's raw mosaic read as grey: the four places of each 2x2 pixels see the same white
/// cloth at different levels. Answers with the picture brought to the brightest place's level, each
/// place by its own gain (median over smooth places of the picture); nothing for a picture whose
/// four places agree within 3 %.
[[nodiscard]] std::optional<GreyImage> without_mosaic(const GreyImage& image);

}  // namespace drape::detect

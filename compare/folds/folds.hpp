// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/sheet.hpp"

namespace drape::compare {

/// A line of largest curvature, with a radius of at most 100 mm and a length of at least 30 mm;
/// shorter lines are dents.
struct Fold {
  Eigen::Vector2d middle_material_m;  ///< material point (warp, weft)
  double length_m = 0;                ///< length in material coordinates
  double direction_rad = 0;           ///< its direction, from warp to weft, 0 .. pi
  double curvature_per_m = 0;         ///< mean over the line; positive for a ridge on the side of
                                      ///< the normal warp x weft, negative for a valley
};

/// Power of a sheet's waves within a band of wavelengths.
struct WaveBand {
  double from_m = 0, to_m = 0;  ///< band of half an octave, in material coordinates
  double height_m2 = 0;         ///< variance of the height
  double curvature_per_m2 = 0;  ///< variance of the mean curvature, 1/m^2
};

struct SheetShape {
  std::vector<WaveBand> bands;     ///< longest wavelength first; sums are the total variances
  std::vector<Fold> folds;         ///< longest first
  double mean_bending_per_m2 = 0;  ///< mean of the sum of squared principal curvatures
};

/// Two-dimensional cosine transform (DCT-II, without jumps at the borders) of height and mean
/// curvature over material coordinates, and the lines of largest curvature. nullopt unless the
/// sheet is a complete grid of at least 5 x 5 points with equal steps.
[[nodiscard]] std::optional<SheetShape> shape_of(const Sheet& sheet);

/// A sheet summarised in one number, for irregular drapes that cannot be compared mark by mark.
struct Descriptor {
  std::string name;  ///< name with unit
  double value = 0;
};

/// Root mean square curvature, standard deviation of the height, wavelength of the curvature
/// (power-weighted geometric mean), number and total length of the folds.
[[nodiscard]] std::vector<Descriptor> descriptors_of(const SheetShape& shape);

}  // namespace drape::compare

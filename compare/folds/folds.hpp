// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

/// A line along which the cloth is bent most, by a radius of at most 100 mm, and at least 30 mm
/// long: shorter lines are dents.
struct Fold {
  Eigen::Vector2d middle_material_m;  ///< (warp, weft)
  double length_m = 0;                ///< extent of the line in the material
  double direction_rad = 0;           ///< its direction, from warp towards weft, 0 .. pi
  double curvature_per_m = 0;         ///< mean of the line; above 0: a ridge on the side that the
                                      ///< normal warp x weft leaves, below 0: a valley
};

/// Power of a sheet's waves between two wavelengths.
struct WaveBand {
  double from_m = 0, to_m = 0;  ///< wavelengths in the material, half an octave
  double height_m2 = 0;         ///< variance of the height
  double curvature_per_m2 = 0;  ///< variance of the mean curvature, 1/m^2
};

struct SheetShape {
  std::vector<WaveBand> bands;     ///< longest first; their sums are the variances of the whole
  std::vector<Fold> folds;         ///< longest first
  double mean_bending_per_m2 = 0;  ///< mean square of the principal curvatures' sum of squares
};

/// Two-dimensional cosine transform (DCT-II: no jump at the borders) of the height and of the mean
/// curvature over the material, and the lines of largest curvature. Nothing unless the sheet is a
/// whole grid of at least 5 x 5 points at equal steps.
[[nodiscard]] std::optional<SheetShape> shape_of(const Sheet& sheet);

/// A sheet in one number, for irregular drapes that no mark can be compared by.
struct Descriptor {
  std::string name;  ///< with its unit
  double value = 0;
};

/// Root mean square curvature, standard deviation of the height, the wavelength of the curvature
/// (mean of its logarithm, weighed by power), number and summed length of the folds.
[[nodiscard]] std::vector<Descriptor> descriptors_of(const SheetShape& shape);

}  // namespace drape::compare

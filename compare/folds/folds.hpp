// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

struct FoldOptions {
  double least_curvature_per_m = 10;  ///< a fold is bent at least so (radius 100 mm)
  double least_length_m = 0.03;       ///< and is so long; shorter ones are dents
};

/// A line along which the cloth is bent most.
struct Fold {
  Eigen::Vector2d middle_material_m;  ///< (warp, weft)
  Eigen::Vector3d middle_in_world;
  double length_m = 0;         ///< of the line in the material
  double direction_rad = 0;    ///< of the line, from warp towards weft, 0 .. pi
  double curvature_per_m = 0;  ///< mean of the line; above 0: a ridge on the side that the normal
                               ///< warp x weft leaves, below 0: a valley
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
/// curvature over the material, and the lines of largest curvature. The sheet must be a whole grid
/// of at least 5 x 5 points at equal steps; throws Error(bad_input) naming `file` otherwise.
[[nodiscard]] SheetShape shape_of(const Sheet& sheet, const FoldOptions& options,
                                  const std::string& file);

/// Why the sheet's shape says nothing: the cause of the measurement that made or placed it, else
/// that it does not rest.
[[nodiscard]] std::optional<std::string> why_no_go(const Sheet& sheet);

/// Throws Error(bad_input) naming both files where two sheets are equal to the last bit: a copy
/// says nothing of how drapes vary.
void require_no_copies(const std::vector<std::pair<std::string, Sheet>>& sheets);

/// Area under the curve of true over false alarms of a score: the part of pairs in which the one of
/// `high` is above that of `low`; equal ones count half (Mann and Whitney 1947).
[[nodiscard]] double area_under_curve(const std::vector<double>& low,
                                      const std::vector<double>& high);

/// A sheet in one number, for groups of sheets that no mark can be compared by.
struct Descriptor {
  std::string name;  ///< with its unit
  double value = 0;
};
/// Root mean square curvature, spread of the height, the wavelength of the curvature (mean of its
/// logarithm, weighed by power), number, summed length and mean curvature of the folds.
[[nodiscard]] std::vector<Descriptor> descriptors_of(const SheetShape& shape);

/// One descriptor over a group of sheets, and against another group.
struct DescriptorSpread {
  std::string name;
  double mean = 0;
  std::optional<double> variation;  ///< standard deviation over mean; absent: one sheet, or mean 0
  std::optional<double> mean_against, variation_against;
  /// Part of the pairs in which the other group's sheet has more: 0.5 says nothing, 0 and 1 tell
  /// the groups apart.
  std::optional<double> area_under_curve;
};
/// `against` may be empty.
[[nodiscard]] std::vector<DescriptorSpread> spreads_of(const std::vector<SheetShape>& sheets,
                                                       const std::vector<SheetShape>& against);

}  // namespace drape::compare

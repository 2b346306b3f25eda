// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

/// Elongation of the straight line between two adjacent marks relative to the flat print. A fold in
/// between shortens it without any strain of the threads.
struct EdgeStrain {
  MarkId from, to;
  bool along_warp = false;
  double real = 0, simulated = 0;  ///< ratios: 0.01 means one per cent longer
};

/// Relative change of the area of the quadrilateral whose corner of lowest row and column is
/// `corner`, as two triangles.
struct AreaStrain {
  MarkId corner;
  double real = 0, simulated = 0;  ///< ratios
};

/// Root mean square of real minus simulated strain.
struct StrainSummary {
  std::optional<double> warp, weft, area;  ///< ratios; absent if there is no such edge or cell
};

struct StrainMaps {
  std::vector<EdgeStrain> edges;
  std::vector<AreaStrain> cells;
  StrainSummary difference;
};

class Surface;

/// Strains of the measured marks' lattice, and of the virtual sheet at the same material points.
/// Covers edges and cells whose marks all exist on both.
[[nodiscard]] StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet);

}  // namespace drape::compare

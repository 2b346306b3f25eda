// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "core/sheet.hpp"

namespace drape::compare {

/// Lengthening of the straight line between two neighbouring marks against the flat print. A
/// fold between the two makes it shorter although no thread is.
struct EdgeStrain {
  MarkId from, to;
  bool along_warp = false;
  double real = 0, simulated = 0;  ///< ratios: 0.01 is one percent longer
};

/// The same for the area of the quadrilateral with its corner of least row and column at `corner`,
/// as two triangles.
struct AreaStrain {
  MarkId corner;
  double real = 0, simulated = 0;  ///< ratios
};

/// Root mean square of real minus simulated.
struct StrainSummary {
  std::optional<double> warp, weft, area;  ///< ratios; absent without such an edge or cell
};

struct StrainMaps {
  std::vector<EdgeStrain> edges;
  std::vector<AreaStrain> cells;
  StrainSummary difference;
};

class Surface;

/// Strains of the measured marks' lattice, and of the virtual sheet at the same material points.
/// Only edges and cells whose marks all exist on both.
[[nodiscard]] StrainMaps strain_maps(const Sheet& measured, const Surface& virtual_sheet);

}  // namespace drape::compare

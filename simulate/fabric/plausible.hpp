// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/error.hpp"

namespace drape::simulate {

struct Fabric;

/// Comparison of a fabric's density and bending with measured fabrics.
struct Plausibility {
  std::vector<Error> problems;  ///< values of no fabric: wrong unit or misplaced decimal point
  std::vector<std::string> warnings;  ///< values of few fabrics, each with file and field
};

/// Compares areal density and bending along warp, weft and at 45 degrees with 618 measured fabrics,
/// and the loops of KES numbers with their slopes. A simulation only warns of problems, since it
/// accepts sheets that are not textiles.
[[nodiscard]] Plausibility judge(const Fabric& fabric);

/// Throws the first problem, for callers that require a textile.
void require_textile(const Fabric& fabric);

/// Usual range of bending stiffness (gf cm2/cm) at an areal density (g/m2): nine of ten fabrics,
/// extended tenfold on either side.
struct UsualBending {
  double from, to;  ///< g/m2
  double least, most;
  double least_possible, most_possible;
};
[[nodiscard]] UsualBending usual_bending(double density_g_per_m2);

}  // namespace drape::simulate

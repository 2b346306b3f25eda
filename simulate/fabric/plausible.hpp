// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/error.hpp"

namespace drape::simulate {

struct Fabric;

/// Places of a fabric's density and bending among those of measured fabrics.
struct Plausibility {
  std::vector<Error> problems;        ///< no fabric has it: another unit, or a decimal point lost
  std::vector<std::string> warnings;  ///< few fabrics have it; each with file and field
};

/// Areal density and bending along warp, weft and at 45 degrees against 618 measured fabrics; the
/// loops of KES numbers against their slopes.
/// A simulation warns of problems only, since it takes sheets that are no textiles.
[[nodiscard]] Plausibility judge(const Fabric& fabric);

/// Throws the first problem: for what calls the numbers those of a textile.
void require_textile(const Fabric& fabric);

/// Bending stiffness (gf cm2/cm) between which fabrics of an areal density (g/m2) lie: nine of ten,
/// and ten times beyond on either side.
struct UsualBending {
  double from, to;  ///< g/m2
  double least, most;
  double least_possible, most_possible;
};
[[nodiscard]] UsualBending usual_bending(double density_g_per_m2);

}  // namespace drape::simulate

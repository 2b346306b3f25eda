// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/certificate.hpp"
#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// Constitutive laws of a cloth, fitted to its measured curves.
struct FittedLaws {
  ClothLaws laws;
  std::vector<CurveReport> curves;
  std::vector<std::string> warnings;  ///< warnings about the fabric and its twist stiffness
};

/// Fits the measured curves up to `reach`, or over the whole measurement without one (a single line
/// over the range of the paper's section 5). `internal_friction` splits the loops of bending and
/// shear into elastic curves and friction elements (laws.friction). Throws Error(bad_input) for a
/// curve that does not rise everywhere.
[[nodiscard]] FittedLaws fit_laws(const Fabric& fabric, int segments,
                                  const std::optional<CurveReach>& reach = std::nullopt,
                                  bool internal_friction = false);

}  // namespace drape::simulate

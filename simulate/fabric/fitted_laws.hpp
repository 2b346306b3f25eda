// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "simulate/fabric/fabric.hpp"
#include "simulate/fabric/laws.hpp"

namespace drape::simulate {

/// Approximation of one Kawabata curve.
struct CurveReport {
  std::string name;        ///< e.g. "tensile warp"
  std::string unit;        ///< unit of the errors: "gf/cm" or "gf cm/cm"
  int segments = 0;        ///< distinct slopes used
  double first_slope = 0;  ///< SI: N/m, N/(m rad) or N m
  double range = 0;        ///< SI: strain, rad or 1/m
  double rms_error = 0;    ///< SI: N/m or N
  double largest_error = 0;
  double half_hysteresis = 0;  ///< SI; what merging the two branches hides
};

/// The laws of a cloth as its measured curves give them.
struct FittedLaws {
  ClothLaws laws;
  std::vector<CurveReport> curves;
  std::vector<std::string> warnings;  ///< those of the fabric, and of the twist stiffness
};

/// Fits the measured curves up to `reach` or, without one, wherever they are measured (a single
/// line where the paper's section 5 takes it). `internal_friction`: splits the loops of bending and
/// shear into elastic curves and friction elements (laws.friction). Throws Error(bad_input) for a
/// curve that does not rise everywhere.
[[nodiscard]] FittedLaws fit_laws(const Fabric& fabric, int segments,
                                  const std::optional<CurveReach>& reach = std::nullopt,
                                  bool internal_friction = false);

}  // namespace drape::simulate

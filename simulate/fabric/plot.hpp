// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/fabric/fabric.hpp"

namespace drape::simulate {

/// SVG of the six Kawabata curves with both branches, each with the line (one segment) and the
/// piecewise linear curve of `segments` used in simulation.
[[nodiscard]] std::string curves_svg(const Fabric& fabric, int segments);

}  // namespace drape::simulate

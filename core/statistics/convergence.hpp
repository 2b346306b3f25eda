// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

namespace drape {

/// Range of convergence orders that three grids can show credibly.
inline constexpr double kLeastOrder = 1, kMostOrder = 3;

/// Order of convergence p that solves (h3^p - h2^p) / (h2^p - h1^p) = `ratio`, the displacement
/// from the coarse to the middle grid over that from the middle to the fine one. `h` holds the
/// spacings from fine to coarse in any unit. The quotient grows with p (Richardson's extrapolation
/// with three grids). nullopt outside [kLeastOrder, kMostOrder].
[[nodiscard]] std::optional<double> order_of(const std::array<double, 3>& h, double ratio);

}  // namespace drape

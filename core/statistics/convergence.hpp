// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

namespace drape {

/// Orders of a discretisation error that three grids may show and be believed.
inline constexpr double kLeastOrder = 1, kMostOrder = 3;

/// Order p at which (h3^p - h2^p) / (h2^p - h1^p) = `ratio` of the two displacements (coarse to
/// middle over middle to fine), `h` the spacings from fine to coarse in any one unit; absent
/// outside [kLeastOrder, kMostOrder]. The quotient grows with p (Richardson's extrapolation, three
/// grids).
[[nodiscard]] std::optional<double> order_of(const std::array<double, 3>& h, double ratio);

}  // namespace drape

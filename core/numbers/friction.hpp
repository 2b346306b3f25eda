// SPDX-License-Identifier: Apache-2.0
#pragma once
namespace drape {
/// Cloth on wood, metal, plastic and skin slides between 0.1 and 1.0; coated cloth on rubber 1.5.
inline constexpr double kLeastFriction = 0.1, kMostFriction = 1.5;
}  // namespace drape

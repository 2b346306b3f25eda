// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

namespace drape {

/// Largest number that a file may hold, in whatever unit: nothing on a bench comes near it, and its
/// square is still finite.
constexpr double largest_number = 1e20;

/// Largest text of a field, in bytes.
constexpr std::size_t largest_text = 1 << 16;

}  // namespace drape

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace drape::capture {

/// Natural order of names: runs of digits compare as numbers, so "set2" comes before "set10". A
/// total order: only identical names are equal.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

}  // namespace drape::capture

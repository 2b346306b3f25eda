// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace drape::capture {

/// Order of names as people count: digit runs compare as numbers, so "set2" comes before
/// "set10". A total order: equal only for equal names.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

}  // namespace drape::capture

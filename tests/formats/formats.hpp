// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/fields/records.hpp"

namespace drape::test {

/// All formats that are described as records, each with a good example.
[[nodiscard]] std::vector<DescribedFormat> all_formats();
/// Those that one stage owns.
[[nodiscard]] std::vector<DescribedFormat> stage_formats();

}  // namespace drape::test

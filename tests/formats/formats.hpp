// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/fields/records.hpp"

namespace drape::test {

/// All formats described as records, each with a valid example.
[[nodiscard]] std::vector<DescribedFormat> all_formats();
/// Those owned by one stage.
[[nodiscard]] std::vector<DescribedFormat> stage_formats();

}  // namespace drape::test

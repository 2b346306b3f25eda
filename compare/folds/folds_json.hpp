// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "compare/folds/folds.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

/// Entries of folds.json.
[[nodiscard]] Json json_of(const std::string& file, const SheetShape& shape);
[[nodiscard]] Json json_of(const DescriptorSpread& spread);

/// For people.
[[nodiscard]] std::string text_of(const DescriptorSpread& spread);

}  // namespace drape::compare

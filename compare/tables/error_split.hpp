// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/tables/tables.hpp"
#include "core/sensitivity.hpp"

namespace drape::compare {

/// A sentence on inputs that differ from those of the run, if any: the measured sheet of the drape,
/// and scene and fabric of its speaker.
[[nodiscard]] std::optional<std::string> other_origin(const HashedFiles& inputs,
                                                      const DrapeInput& drape);

/// A sentence explaining why the base is not one of the drape's simulations, if so.
[[nodiscard]] std::optional<std::string> other_base(const SensitivityFile& split,
                                                    const DrapeInput& drape);

/// Fabric values, sorted by decreasing change.
[[nodiscard]] Table value_effect_table(const SensitivityFile& split);
/// Changed models in the order of the file; marks the largest change among those at rest.
[[nodiscard]] Table variant_effect_table(const SensitivityFile& split);
/// Names the change with the largest effect on the mean distance, in one sentence without a full
/// stop; empty if nothing was changed.
[[nodiscard]] std::string error_split_sentence(const SensitivityFile& split);

}  // namespace drape::compare

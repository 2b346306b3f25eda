// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "compare/records/provenance.hpp"
#include "compare/tables/tables.hpp"
#include "core/sensitivity.hpp"

namespace drape::compare {

/// A sentence on inputs that a run was not made from, if any: the drape's
/// measured sheet, scene and fabric of the simulation that speaks for it.
[[nodiscard]] std::optional<std::string> other_origin(const HashedFiles& inputs,
                                                      const DrapeInput& drape);

/// Why the base is none of the drape's simulations, in a sentence, if so.
[[nodiscard]] std::optional<std::string> other_base(const SensitivityFile& split,
                                                    const DrapeInput& drape);

/// Fabric values, the greatest change first.
[[nodiscard]] Table value_effect_table(const SensitivityFile& split);
/// Changed models in the order of the file; the greatest change among those at rest is marked.
[[nodiscard]] Table variant_effect_table(const SensitivityFile& split);
/// Change that moves the mean distance most, one sentence without a full stop; empty when nothing
/// was changed.
[[nodiscard]] std::string error_split_sentence(const SensitivityFile& split);

}  // namespace drape::compare

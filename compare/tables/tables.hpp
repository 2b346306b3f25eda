// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compare/compare.hpp"
#include "compare/records/provenance.hpp"
#include "core/files/json_file.hpp"

namespace drape::compare {

/// Text by RFC 4180: cells with a comma, quote or line break are quoted.
[[nodiscard]] std::string csv_of(const Table& table);
/// Array of objects; cells of numeric columns become numbers (integers if without a point), and
/// empty cells null.
[[nodiscard]] Json json_of(const Table& table);

/// Tables of one drape, including those of its headline simulation.
[[nodiscard]] std::vector<ReportedTable> tables_of(const DrapeInput& input, const Report& report,
                                                   const std::optional<SensitivityFile>& split);

/// A name of a file format in words for people.
[[nodiscard]] std::string in_words(std::string name);

/// The paper's odd tables: discretisation, segments, mean distance, followed by measures that the
/// paper does not have.
[[nodiscard]] Table real_virtual_table(const DrapeInput& input, const Report& report);
/// The equilibria of one list by energy, with the lowest and the one nearest to the real shape
/// marked.
[[nodiscard]] Table branch_table(const DrapeInput& input, const Report& report,
                                 const BranchSet& set);
/// Sentence without a full stop, such as "the real shape is nearest to branch 5 of 12 ...".
[[nodiscard]] std::string branch_sentence(const DrapeInput& input, const BranchSet& set);
/// The paper's even tables: pairs of simulations of one drape or one scene, by its name.
[[nodiscard]] Table pair_table(const std::string& name, const std::vector<VirtualVirtual>& pairs);
/// One row per measured mark: its sigma and views, and its distance from every simulation.
[[nodiscard]] Table mark_table(const DrapeInput& input, const Report& report);

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

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/files/json_file.hpp"
#include "simulate/refine/refine.hpp"

namespace drape::simulate {

/// "61x61": where the files of that grid lie, in the folder of refinement.json.
[[nodiscard]] std::string folder_of(const RefinedGrid& grid);

/// refinement.json (schema drapebench/refinement/1). `rest_sha256`: of sheet.json of the rest;
/// `folder` holds the sheets, which are written.
[[nodiscard]] Json refinement_json(const Refinement& refinement, const Print& print,
                                   const RefineOptions& how, const std::string& rest_sha256,
                                   const std::filesystem::path& folder);

/// What the grid leaves, for people, without a full stop.
[[nodiscard]] std::string left_sentence(const Refinement& refinement);

}  // namespace drape::simulate

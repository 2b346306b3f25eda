// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "core/run_report.hpp"

namespace drape::compare {

/// Returns everything found by a call of drape-compare, for a report in `folder`, to which paths
/// are relative. The same session gives the same record, so the run's date is its only time.
[[nodiscard]] RunReport account_of(const Session& session, const Outcome& outcome,
                                   const std::filesystem::path& folder);

/// Tables of one drape, including those of its headline simulation.
[[nodiscard]] std::vector<ReportedTable> tables_of(const DrapeFiles& drape, const Report& report);
/// Photographs of one drape with its marks and, if calibrated, its virtual cloth.
[[nodiscard]] std::vector<ReportedView> views_of(const DrapeFiles& drape, const Report& report,
                                                 const Session& session,
                                                 const std::filesystem::path& folder);
/// The virtual cloth with some 40 points per side at most, and the objects under it.
[[nodiscard]] std::optional<ReportedShape> shape_of(const DrapeInput& input, const Report& report);
[[nodiscard]] ReportedProvenance provenance_of(const Session& session, const Outcome& outcome,
                                               const std::filesystem::path& folder);

/// Text common to warnings that differ only in step, drape and numbers.
[[nodiscard]] std::string kind_of_note(const std::string& text);

}  // namespace drape::compare

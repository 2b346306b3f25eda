// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "core/run_report.hpp"

namespace drape::compare {

/// Everything that a call of drape-compare found, for a report in `folder`: paths are relative to
/// it. The same session gives the same record, so that no clock time is in it but the run's date.
[[nodiscard]] RunReport account_of(const Session& session, const Outcome& outcome,
                                   const std::filesystem::path& folder);

/// The tables of one drape, those of its headline simulation among them.
[[nodiscard]] std::vector<ReportedTable> tables_of(const DrapeFiles& drape, const Report& report);
/// The photographs of one drape with its marks and, with a calibration, its virtual cloth.
[[nodiscard]] std::vector<ReportedView> views_of(const DrapeFiles& drape, const Report& report,
                                                 const Session& session,
                                                 const std::filesystem::path& folder);
/// The virtual cloth, some 40 points a side at most, and the objects under it.
[[nodiscard]] std::optional<ReportedShape> shape_of(const DrapeInput& input, const Report& report);
[[nodiscard]] ReportedProvenance provenance_of(const Session& session, const Outcome& outcome,
                                               const std::filesystem::path& folder);

/// The same for warnings that differ in step, drape and numbers alone.
[[nodiscard]] std::string kind_of_note(const std::string& text);

}  // namespace drape::compare

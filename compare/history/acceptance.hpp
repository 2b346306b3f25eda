// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compare/store/inputs.hpp"
#include "compare/store/outcome.hpp"
#include "compare/store/store.hpp"
#include "core/acceptance_file.hpp"
#include "core/program/run_record.hpp"

namespace drape::compare {

/// Reasons why an acceptance does not apply to the measurements of this session: made for another
/// calibration, or expired on the day of the recording. Empty if it applies.
[[nodiscard]] std::vector<std::string> doubts_of(const AcceptanceFile& acceptance,
                                                 const Session& session);

/// Reasons why results from a calibration of the session are NO-GO, by the calibration's SHA-256:
/// its last acceptance is NO-GO, among those in the store (if any) and the given one, which counts
/// as the later of two on one day.
[[nodiscard]] std::map<std::string, std::string> reason_in_store(
    const std::filesystem::path& store, const Session& session,
    const std::optional<AcceptanceFile>& given = {});

/// Reads the acceptance, if given, as an input of `record`, before anything is compared; its doubts
/// become warnings. Reasons against it and against those in the outcome's store are added to the
/// outcome.
[[nodiscard]] std::optional<AcceptanceFile> look_at_acceptance(const std::filesystem::path& file,
                                                               const Session& session,
                                                               Outcome& outcome, RunRecord& record);

/// Stores an acceptance, once.
void store_acceptance(const std::filesystem::path& store, const AcceptanceFile& acceptance);

}  // namespace drape::compare

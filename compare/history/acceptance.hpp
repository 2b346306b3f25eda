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

/// Why it does not speak for what this session measured: of another calibration, or expired on the
/// day of the recording. Empty when it does.
[[nodiscard]] std::vector<std::string> doubts_of(const AcceptanceFile& acceptance,
                                                 const Session& session);

/// Why what rests on a calibration of the session is NO-GO, by the calibration's SHA-256: its last
/// acceptance is, among those in the store (where there is one) and the one that is given, which
/// counts as the later of two of one day.
[[nodiscard]] std::map<std::string, std::string> reason_in_store(
    const std::filesystem::path& store, const Session& session,
    const std::optional<AcceptanceFile>& given = {});

/// Reads it, where a file is given, as an input of `record`, before anything is compared; its
/// doubts become warnings. Reasons against it and against those in the outcome's store go to the
/// outcome.
[[nodiscard]] std::optional<AcceptanceFile> look_at_acceptance(const std::filesystem::path& file,
                                                               const Session& session,
                                                               Outcome& outcome, RunRecord& record);

/// Keeps it in the store, once.
void store_acceptance(const std::filesystem::path& store, const AcceptanceFile& acceptance);

}  // namespace drape::compare

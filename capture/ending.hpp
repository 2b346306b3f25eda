// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/capture.hpp"
#include "capture/recording/record.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

/// The last lines after an import into `recording_folder`.
[[nodiscard]] Ending ending_of(const ImportResult& result,
                               const std::filesystem::path& recording_folder);

/// The last lines after a verification: every fault by name.
[[nodiscard]] Ending ending_of(const VerifyReport& report);

/// The last lines of a capture: good when every set that was asked for is stored.
[[nodiscard]] Ending ending_of(const LiveReport& report, const RecordResult& stored, int frames,
                               const std::filesystem::path& recording_folder);

/// A fault as the screen says it, with how often it was seen.
[[nodiscard]] std::string line_of(const LiveFault& fault);

}  // namespace drape::capture

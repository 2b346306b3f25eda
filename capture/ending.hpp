// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/capture.hpp"
#include "capture/recording/record.hpp"
#include "core/program/program.hpp"

namespace drape::capture {

/// Ending of an import into `recording_folder`.
[[nodiscard]] Ending ending_of(const ImportResult& result,
                               const std::filesystem::path& recording_folder);

/// Ending of a verification, which names every fault.
[[nodiscard]] Ending ending_of(const VerifyReport& report);

/// Ending of a capture: GO if every requested set was stored.
[[nodiscard]] Ending ending_of(const LiveReport& report, const RecordResult& stored, int frames,
                               const std::filesystem::path& recording_folder);

/// Describes a fault on one line, with the number of times it occurred.
[[nodiscard]] std::string line_of(const LiveFault& fault);

}  // namespace drape::capture

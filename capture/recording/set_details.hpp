// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "capture/live/live_capture.hpp"
#include "capture/recording/record.hpp"
#include "core/files/json_file.hpp"

namespace drape::capture {

/// Content of a set's capture.json: times, spread, settings read back, clocks, ledger up to then,
/// stillness, faults, and why the set is no measurement, if it is none.
[[nodiscard]] Json set_details(const std::string& name, const LiveSet& set,
                               const std::vector<FrameQuality>& qualities, std::size_t averaged,
                               const LiveReport& report, const StillReport& still,
                               const RecordOptions& options,
                               const std::optional<std::string>& no_go);

}  // namespace drape::capture

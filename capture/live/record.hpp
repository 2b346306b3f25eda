// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/live/frame_quality.hpp"
#include "capture/live/live_capture.hpp"
#include "core/recording.hpp"

namespace drape {

struct RecordOptions {
  std::filesystem::path folder;  ///< of the recording; made, or one to which the set is added
  std::string set;
  bool average = false;  ///< one set, the mean of all frames, instead of one set per frame
  double largest_spread_s = 0;
  QualityLimits limits;
  std::string recorded_on;  ///< ISO date
};

struct RecordResult {
  std::vector<std::string> sets;   ///< that were stored
  std::vector<LiveFault> refused;  ///< frames and sets that were not, with reason and remedy
  std::vector<std::string> files;  ///< images, relative to the folder
};

/// Throws Error(bad_input) when the recording already holds a set of this name (or, for several
/// frames, of one that begins with it), or the name cannot be a folder's. Call before capturing.
void require_new_set(const RecordOptions& options);

/// Stores every good set: <set>/<camera>.png, <set>/capture.json (times, spread, settings read
/// back, clocks, ledger), and recording.json last. Sets are <set>, or <set>_000, <set>_001, ... for
/// several frames. A set is refused when one of its frames is black, saturated or blurred, has
/// another size than the rig says, or its spread is too large; nothing of it is written.
[[nodiscard]] RecordResult record_live(const LiveResult& live, const CamerasFile& cameras,
                                       const RecordOptions& options);

}  // namespace drape
